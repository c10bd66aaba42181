"""Names, units and symbols of everything a Dataset may hold: one table for programs, plots and documentation.

The numbers that a mesh cycle answers declare theirs themselves, see ``gearbench.results.responses``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Quantity:
    """One variable or coordinate of a Dataset: its unit, symbol and meaning."""

    units: str
    symbol: str
    long_name: str

    @property
    def label(self) -> str:
        """Meaning and symbol in one line."""
        return f"{self.long_name} {self.symbol}".strip()

    @property
    def unit(self) -> str:
        """Unit as people read it: "" where there is none."""
        return "" if self.units == "1" else self.units

    @property
    def attrs(self) -> dict[str, str]:
        """Attributes of an xarray variable."""
        return {"units": self.units, "symbol": self.symbol, "long_name": self.long_name}


#: By group, as the documentation lists them.
GROUPS: Mapping[str, Mapping[str, Quantity]] = MappingProxyType(
    {
        "coordinates": {
            "mesh_phase": Quantity("1", "τ", "mesh phase"),
            "phase_weight": Quantity("1", "w", "weight in means over the mesh cycle"),
            "load_weight": Quantity("1", "g", "weight in means over the loads"),
            "panel_start": Quantity("1", "τ_0", "start of the Gauss panel; NaN for uniform phases"),
            "panel_end": Quantity("1", "τ_1", "end of the Gauss panel; NaN for uniform phases"),
            "harmonic": Quantity("1", "n", "order of the mesh frequency"),
            "pair_index": Quantity("1", "k", "number of the tooth pair"),
            "gear": Quantity("1", "", "name of the gear"),
            "path_position": Quantity("mm", "u", "position on the path of contact"),
            "face_position": Quantity("mm", "y", "position along the face width"),
            "segment_length": Quantity("mm", "ℓ", "length of a segment along the contact line"),
        },
        "over the mesh cycle": {
            "transmission_error": Quantity("µm", "δ", "static transmission error along the line of action"),
            "mesh_stiffness": Quantity("N/µm", "k", "mesh stiffness"),
            "line_load": Quantity("N/mm", "q", "line load"),
            "load_share": Quantity("1", "X", "load share of a tooth pair"),
            "share_outside_path": Quantity("1", "X_out", "share of the load outside the path of contact"),
            "initial_gap": Quantity("µm", "e", "initial gap from micro-geometry and errors"),
            "transmission_error_amplitude": Quantity("µm", "|δ_n|", "amplitudes of the harmonics of δ"),
            "transmission_error_amplitude_noise_floor": Quantity("µm", "ε(δ_n)", "noise floor of the harmonics of δ"),
            "transmission_error_peak_to_peak_noise_floor": Quantity("µm", "ε(PP δ)", "noise floor of peak-to-peak δ"),
            "mesh_stiffness_peak_to_peak_noise_floor": Quantity("N/µm", "ε(PP k)", "noise floor of peak-to-peak k"),
            "transmission_error_phase": Quantity("rad", "arg δ_n", "phases of the harmonics of δ"),
            "mesh_stiffness_amplitude": Quantity("N/µm", "|k_n|", "amplitudes of the harmonics of k"),
            "mesh_stiffness_amplitude_noise_floor": Quantity("N/µm", "ε(k_n)", "noise floor of the harmonics of k"),
            "mesh_stiffness_phase": Quantity("rad", "arg k_n", "phases of the harmonics of k"),
        },
        "trains and planetary sets": {
            "mesh": Quantity("1", "", "name of the mesh"),
            "phase_shift": Quantity("1", "φ", "mesh phase relative to the first mesh"),
            "member": Quantity("1", "", "name of the shaft or carrier"),
            "axis": Quantity("1", "", "direction in the transverse plane"),
            "motion": Quantity("1", "", "name of a free motion"),
            "mesh_load": Quantity("N", "F_bt", "mesh force along the transverse line of action"),
            "load_sharing": Quantity("1", "L", "mesh force relative to equal sharing"),
            "revolution": Quantity("1", "", "revolutions of the carrier relative to the ring"),
            "load_sharing_over_revolution": Quantity("1", "L", "largest load share over the mesh cycle"),
            "load_sharing_greatest": Quantity("1", "L", "largest load share over the mesh cycle"),
            "train_transmission_error": Quantity("µm", "Δ", "transmission error of the train on the first base circle"),
            "train_transmission_error_amplitude": Quantity("µm", "|Δ_n|", "amplitudes of the harmonics of Δ"),
            "train_transmission_error_amplitude_noise_floor": Quantity(
                "µm", "ε(Δ_n)", "noise floor of the harmonics of Δ"
            ),
            "train_transmission_error_peak_to_peak_noise_floor": Quantity(
                "µm", "ε(PP Δ)", "noise floor of peak-to-peak Δ"
            ),
            "train_transmission_error_phase": Quantity("rad", "arg Δ_n", "phases of the harmonics of Δ"),
            "turning_error": Quantity("µrad", "Δθ", "Δ as an angle of an input or output member"),
            "train_stiffness": Quantity("N/µm", "k_Δ", "stiffness of the train on the first base circle"),
            "motion_amount": Quantity("µm", "q", "free motion"),
            "member_force": Quantity("N", "F", "force of all meshes on a member"),
            "member_force_amplitude": Quantity("N", "|F_n|", "amplitudes of the harmonics of the force on a member"),
            "member_torque": Quantity("N·m", "M", "torque of all meshes on a member"),
            "member_torque_amplitude": Quantity("N·m", "|M_n|", "amplitudes of the harmonics of the torque"),
        },
        "over the revolutions": {
            "cycle": Quantity("1", "n", "number of the mesh cycle"),
            "mesh_order": Quantity("1", "ν", "order in multiples of the mesh frequency"),
            "pinion_order": Quantity("1", "ν z_1", "order in multiples of the speed of the pinion"),
            "wheel_order": Quantity("1", "ν z_2", "order in multiples of the speed of the wheel"),
            "transmission_error_order_amplitude": Quantity("µm", "|δ_ν|", "amplitudes of the orders of δ"),
            "member_order": Quantity("1", "ν z", "order in multiples of the speed of a member, seen from the carrier"),
            "train_transmission_error_order_amplitude": Quantity("µm", "|Δ_ν|", "amplitudes of the orders of Δ"),
            "load_sharing_order_amplitude": Quantity("1", "|L_ν|", "amplitudes of the orders of the load share"),
            "passing_force": Quantity("N", "F_p", "force of the planets on the ring as they pass a sensor on it"),
            "passing_force_order_amplitude": Quantity("N", "|F_pν|", "amplitudes of the orders of F_p"),
            "mesh_stiffness_order_amplitude": Quantity("N/µm", "|k_ν|", "amplitudes of the orders of k"),
        },
        "on the flank": {
            "flank_pressure": Quantity("MPa", "p", "Hertz pressure of a segment"),
            "flank_pressure_max": Quantity("MPa", "max p", "largest Hertz pressure over the mesh cycle"),
            "specific_sliding": Quantity("1", "ζ", "specific sliding"),
            "sliding_speed": Quantity("m/s", "v_g", "sliding speed, positive if the pinion's flank is faster"),
            "flash_temperature": Quantity("K", "Θ_fl", "flash temperature"),
            "flash_temperature_max": Quantity("K", "max Θ_fl", "largest flash temperature over the mesh cycle"),
            "face_load_factor": Quantity("1", "K_Hβ", "largest load over mean load of the face"),
            "loaded_contact_ratio": Quantity("1", "ε_load", "mean number of tooth pairs that carry load"),
            "root_stress": Quantity("MPa", "σ_F0", "nominal root stress"),
            "loaded_root_stress": Quantity("MPa", "σ_F", "root stress from the computed load"),
            "friction_coefficient": Quantity("1", "μ", "coefficient of friction of the mesh"),
            "friction_loss": Quantity("W", "P_VZ", "friction loss of the mesh"),
            "mesh_efficiency": Quantity("1", "η_z", "efficiency of the mesh"),
        },
        "limits of a design": {
            "tip_room": Quantity("mm", "g_a", "distance of the tips of ring and pinion off the path of contact"),
            "radial_room": Quantity("mm", "g_r", "distance of the tips in radial assembly"),
            "form_room": Quantity(
                "mm", "g_F", "least length of the path of contact between fillet and tip of the mate"
            ),
            "total_contact_ratio": Quantity("1", "ε_γ", "total contact ratio"),
            "transverse_contact_ratio": Quantity("1", "ε_α", "transverse contact ratio"),
            "overlap_ratio": Quantity("1", "ε_β", "overlap ratio"),
            "contact_pressure": Quantity("MPa", "σ_H", "largest contact pressure"),
            "gear_ratio": Quantity("1", "u", "ratio of the numbers of teeth, or of the speeds of a planetary set"),
            "mass": Quantity("kg", "m", "mass of all gears"),
            "planet_room": Quantity("mm", "g_p", "room between the tips of neighbouring planets"),
            "spacing_error": Quantity("deg", "Δψ", "greatest distance of a planet from even spacing"),
            "torsion_share": Quantity("1", "", "part of the planets' first harmonics that adds up as torsion"),
            "radial_share": Quantity("1", "", "part of the planets' first harmonics that adds up as radial force"),
            "cost": Quantity("1", "", "total cost of the values of the variables"),
        },
        "comparison with a reference": {
            "load_share_error_max": Quantity("1", "max |ΔX|", "largest difference of the load share of a pair"),
            "load_share_error_rms": Quantity("1", "RMS ΔX", "RMS difference of the load share of a pair in contact"),
            "load_radius": Quantity("mm", "R", "radius of the load"),
            "load_position": Quantity("mm", "y", "position of the load along the face width"),
            "mac": Quantity("1", "MAC", "modal assurance criterion of the deflection shapes under one load"),
            "mac_worst": Quantity("1", "min MAC", "worst modal assurance criterion of all loads"),
            "mac_mean": Quantity("1", "mean MAC", "mean modal assurance criterion of all loads"),
            "line_mac_worst": Quantity("1", "min MAC_l", "worst modal assurance criterion under a contact line"),
            "line_mac_mean": Quantity("1", "mean MAC_l", "mean modal assurance criterion under contact lines"),
            "norm_ratio": Quantity("1", "‖w‖/‖w_ref‖", "deflection over that of the reference under one load"),
            "compliance_ratio": Quantity("1", "‖C‖/‖C_ref‖", "compliance over that of the reference under all loads"),
            "reference_error": Quantity("1", "η", "estimated relative error of the reference's compliance"),
            "reference_unknowns": Quantity("1", "N", "unknowns of the reference's finest level"),
            "reference_meshes": Quantity("1", "n", "refinement levels of the reference"),
            "reference_seconds": Quantity("s", "t", "wall time of the reference's compliance at all levels"),
            "reference_settled": Quantity(
                "1", "–", "whether the reference is five times as accurate as the difference"
            ),
            "reference_cached": Quantity("1", "–", "whether the reference was read from disk"),
            "compliance_seconds": Quantity("s", "t_C", "wall time of the smooth compliance of a new pair"),
            "simulation_seconds": Quantity("s", "t_S", "wall time of a simulation with known teeth"),
            "first_call_seconds": Quantity("s", "t_1", "wall time of the first simulation in the process"),
        },
        "cost of accuracy": {
            "setting_error": Quantity("1", "ε", "relative error of a setting"),
            "setting_error_bar": Quantity("1", "Δε", "uncertainty of its reference"),
            "seconds": Quantity("s", "t", "wall time of a run, median of repeats"),
            "processor_seconds": Quantity("s", "t_p", "processor time of a run, median of repeats"),
            "megabytes": Quantity("MB", "M", "largest memory taken during a run"),
            "observed_order": Quantity("1", "p", "observed order of convergence"),
        },
        "over speed": {
            "speed": Quantity("1/min", "n", "speed of the pinion"),
            "mesh_frequency": Quantity("Hz", "f_z", "mesh frequency"),
            "dynamic_transmission_error_amplitude": Quantity(
                "µm", "x_n", "amplitude of the dynamic transmission error"
            ),
            "dynamic_transmission_error_phase": Quantity("rad", "arg x_n", "phase of the dynamic transmission error"),
            "dynamic_transmission_error_rms": Quantity(
                "µm", "RMS x", "RMS of the fluctuating dynamic transmission error"
            ),
            "mesh_force_amplitude": Quantity("N", "f_n", "amplitude of the mesh force along the line of action"),
            "mesh_force_by_source_amplitude": Quantity(
                "N", "f_n", "amplitude of the mesh force at the frequency of another mesh"
            ),
            "mesh_force_combination_amplitude": Quantity(
                "N", "f_nm", "amplitude of the mesh force at a combination of two mesh frequencies"
            ),
            "combination_residual": Quantity("1", "–", "residual of the balance of all mesh frequencies"),
            "combination_frequency": Quantity("Hz", "|n f_1 + m f_2|", "frequency of a combination"),
            "mesh_force_phase": Quantity("rad", "arg f_n", "phase of the mesh force"),
            "mesh_force_rms": Quantity("N", "RMS f", "RMS of the fluctuating mesh force"),
            "mean_force": Quantity("N", "F_bt", "mean mesh force along the line of action"),
            "mesh_force_percentile": Quantity(
                "N", "RMS f", "percentile of the RMS of the mesh force over error samples"
            ),
            "mesh_force_rms_mean": Quantity("N", "mean RMS f", "mean of the RMS of the mesh force over error samples"),
            "mesh_force_rms_std": Quantity(
                "N", "σ RMS f", "standard deviation of the RMS of the mesh force over samples"
            ),
            "mesh_force_rms_max": Quantity("N", "max RMS f", "largest RMS of the mesh force of all error samples"),
            "dynamic_factor": Quantity("1", "max f/F_bt", "largest over mean mesh force, at the worst relative phase"),
            "contact_kept": Quantity("1", "f > 0", "whether the flanks never part"),
            "floquet_multiplier": Quantity(
                "1",
                "max |μ|",
                "largest Floquet multiplier; stable below 1, NaN if proven otherwise",
            ),
            "bearing_load": Quantity("N", "B", "mean force of a shaft on its bearing"),
            "friction_force_amplitude": Quantity(
                "N", "R_n", "estimate of the friction force across the line of action, coefficient 0.05"
            ),
            "gear_deflection": Quantity("µm", "u", "static deflection of the axis at the middle of a gear"),
            "gear_tilt": Quantity("mrad", "φ", "static tilt of the axis at the middle of a gear"),
            "mesh_misalignment": Quantity(
                "µm", "F_β", "static misalignment over the face in the plane of action, due to both axes"
            ),
            "ripple_frequency": Quantity("Hz", "f", "frequency of a ripple"),
            "ripple_transmission_error_amplitude": Quantity(
                "µm", "x", "amplitude of the dynamic transmission error at the frequency of a ripple"
            ),
            "ripple_mesh_force_amplitude": Quantity(
                "N", "f", "amplitude of the mesh force at the frequency of a ripple"
            ),
            "ripple_bearing_force_amplitude": Quantity(
                "N", "B", "amplitude of a bearing force at the frequency of a ripple"
            ),
            "mode_energy": Quantity("1", "–", "share of a part in the strain energy of a mode"),
            "shaft_mode_shape": Quantity(
                "1", "φ_r", "motion of the axis of a shaft, and twist as an arc, relative to the largest"
            ),
            "shaft_position": Quantity("mm", "z", "position on the shaft"),
            "bearing_force_amplitude": Quantity("N", "B_n", "amplitude of a bearing force"),
            "bearing_force_phase": Quantity("rad", "arg B_n", "phase of a bearing force"),
            "bearing_torque_amplitude": Quantity("N·m", "M_n", "amplitude of the torque that holds a member"),
            "train_dynamic_transmission_error_amplitude": Quantity(
                "µm", "Δ_n", "amplitude of the dynamic transmission error of the train"
            ),
            "train_dynamic_transmission_error_phase": Quantity(
                "rad", "arg Δ_n", "phase of the dynamic transmission error of the train"
            ),
            "train_dynamic_transmission_error_rms": Quantity(
                "µm", "RMS Δ", "RMS of the dynamic transmission error of the train"
            ),
            "lobes": Quantity("1", "k", "lobes of a force wave round the ring; positive ahead of the planets"),
            "ring_wave_amplitude": Quantity("N", "F_nk", "amplitude of a force wave round the ring"),
            "ring_wave_frequency": Quantity("Hz", "n f_z + k f_c", "frequency of the wave at a point of the ring"),
            "housing_amplitude": Quantity("1", "y_n", "amplitude at a point of the housing"),
            "housing_phase": Quantity("rad", "arg y_n", "phase at a point of the housing"),
            "periods": Quantity("1", "–", "mesh periods after which the motion repeats; 0 if it does not"),
            "natural_frequency": Quantity("Hz", "f_r", "natural frequency with the mean mesh stiffness"),
            "mode_participation": Quantity("1", "–", "share of a mode in the static compliance at a mesh"),
            "mode_kind": Quantity("1", "–", "rotational, translational, planet or mixed mode"),
            "mode_shape": Quantity("1", "φ_r", "motion of each member relative to the largest; rotations as arcs"),
            "component": Quantity("1", "–", "component of the motion of a member"),
            "critical_speed": Quantity("1/min", "n_E", "speed at which an order of the mesh frequency excites a mode"),
        },
        "random errors": {
            "error": Quantity("µm", "ε", "manufacturing error; phases in °, other keys in their unit"),
            "backlash": Quantity("mm", "j_wt", "circumferential backlash at the working pitch circles"),
            "tightening_cost": Quantity("1", "", "relative cost of a tolerance one class finer"),
        },
        "contact solution": {
            "equilibrium_residual": Quantity("1", "|ΣP−F|/F", "relative residual of the force balance"),
            "minimum_force": Quantity("1", "min P/F", "smallest segment force over the normal force"),
            "complementarity_residual": Quantity("1", "max|min(P,g)|", "residual of the contact conditions"),
            "newton_steps": Quantity("1", "n", "steps of Newton's method"),
        },
        "optimisation": {
            "code": Quantity(
                "1",
                "",
                "index of a variable's value, or the value if real",
            ),
            "objective": Quantity("1", "", "objectives, minimised"),
            "objective_before": Quantity("1", "", "objectives before polishing"),
            "violation": Quantity("1", "", "sum of the relative violations of the limits"),
            "feasible": Quantity("1", "", "whether the design keeps all limits"),
            "reason": Quantity("1", "", "why the design is not feasible"),
            "evaluated_samples": Quantity("1", "n", "error samples of the design"),
            "first_generation": Quantity("1", "", "generation that first contained the design"),
            "on_front": Quantity("1", "", "whether the design is Pareto-optimal"),
            "in_population": Quantity("1", "", "whether the design is in the last population"),
            "asked": Quantity("1", "", "designs in the generation"),
            "asked_design": Quantity("1", "", "designs of each generation; -1 beyond their number"),
            "evaluated": Quantity("1", "", "newly computed designs"),
            "feasible_found": Quantity("1", "", "feasible designs known so far"),
            "hypervolume": Quantity("1", "", "share of the box below the reference point dominated by the front"),
            "reference_point": Quantity("1", "", "reference point of the hypervolume"),
            "number": Quantity("1", "", "number of the design in the stored optimisation"),
            "shift": Quantity("%", "", "change of the objective with the reference"),
            "verified": Quantity("1", "", "whether the reference could be computed"),
            "rank_correlation": Quantity("1", "", "rank correlation (Spearman) of both results"),
        },
        "designs": {
            "axial_force": Quantity("N", "F_a", "axial force under the torque of the scene"),
            "modifications": Quantity("1", "n", "kinds of micro-geometry on the flanks"),
            "pinion_teeth": Quantity("1", "z_1", "teeth of the pinion"),
            "wheel_teeth": Quantity("1", "z_2", "teeth of the wheel"),
            "pinion_addendum": Quantity("1", "h_a1*", "addendum of the pinion"),
            "wheel_addendum": Quantity("1", "h_a2*", "addendum of the wheel"),
        },
    }
)
QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {name: quantity for group in GROUPS.values() for name, quantity in group.items()}
)

#: Keys of a scene, and design variables derived from them, by their last parts.
KEYS: Mapping[str, Quantity] = MappingProxyType(
    {
        "helix_angle": Quantity("°", "β", "helix angle"),
        "pressure_angle": Quantity("°", "α_n", "pressure angle"),
        "normal_module": Quantity("mm", "m_n", "normal module"),
        "face_width": Quantity("mm", "b", "face width"),
        "centre_distance": Quantity("mm", "a′", "centre distance"),
        "addendum": Quantity("1", "h_a*", "addendum"),
        "addendum_fraction": Quantity("1", "", "addendum fraction"),
        "teeth": Quantity("1", "z", "teeth"),
        "torque": Quantity("N·m", "T", "torque"),
        "crowning.amount": Quantity("µm", "C_β", "crowning"),
        "tip_relief.amount": Quantity("µm", "f", "tip relief"),
        "tip_relief.length": Quantity("mm", "L", "tip relief length"),
        "tip_relief.length_fraction": Quantity("1", "L/h_e", "tip relief"),
        "root_relief.amount": Quantity("µm", "", "root relief"),
        "root_relief.length": Quantity("mm", "", "root relief length"),
        "root_relief.length_fraction": Quantity("1", "L/h_e", "root relief"),
        "end_relief.amount": Quantity("µm", "", "end relief"),
        "end_relief.length": Quantity("mm", "", "end relief length"),
        "profile_slope.pinion": Quantity("µm", "f_Hα1", "profile slope of the pinion"),
        "profile_slope.wheel": Quantity("µm", "f_Hα2", "profile slope of the wheel"),
        "helix_slope.pinion": Quantity("µm", "f_Hβ1", "helix slope of the pinion"),
        "helix_slope.wheel": Quantity("µm", "f_Hβ2", "helix slope of the wheel"),
    }
)
