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
            "phase_weight": Quantity("1", "w", "weight of the mesh phase in means over the mesh cycle"),
            "load_weight": Quantity("1", "g", "share of the load in means over the loads"),
            "panel_start": Quantity(
                "1", "τ_0", "beginning of the position's Gauss panel; NaN where phases are uniform"
            ),
            "panel_end": Quantity("1", "τ_1", "end of the position's Gauss panel; NaN where phases are uniform"),
            "harmonic": Quantity("1", "n", "order of the harmonic of the mesh frequency"),
            "pair_index": Quantity("1", "k", "number of the tooth pair"),
            "gear": Quantity("1", "", "name of the gear"),
            "path_position": Quantity(
                "mm", "u", "position on the path of contact from the pinion's interference point"
            ),
            "face_position": Quantity("mm", "y", "position along the face width"),
            "segment_length": Quantity("mm", "ℓ", "length of a segment along the contact line"),
        },
        "over the mesh cycle": {
            "transmission_error": Quantity("µm", "δ", "static transmission error along the line of action"),
            "mesh_stiffness": Quantity("N/µm", "k", "mesh stiffness"),
            "line_load": Quantity("N/mm", "q", "line load"),
            "load_share": Quantity("1", "X", "share of the load on a tooth pair"),
            "share_outside_path": Quantity("1", "X_out", "share of the load outside the path of contact"),
            "initial_gap": Quantity("µm", "e", "initial gap from micro-geometry and errors"),
            "transmission_error_amplitude": Quantity("µm", "|δ_n|", "amplitudes of the harmonics of δ"),
            "transmission_error_amplitude_noise_floor": Quantity(
                "µm", "ε(δ_n)", "numerical noise floor of the amplitudes of the harmonics of δ"
            ),
            "transmission_error_peak_to_peak_noise_floor": Quantity(
                "µm", "ε(PP δ)", "numerical noise floor of peak-to-peak δ"
            ),
            "mesh_stiffness_peak_to_peak_noise_floor": Quantity(
                "N/µm", "ε(PP k)", "numerical noise floor of peak-to-peak k"
            ),
            "transmission_error_phase": Quantity("rad", "arg δ_n", "phases of the harmonics of δ"),
            "mesh_stiffness_amplitude": Quantity("N/µm", "|k_n|", "amplitudes of the harmonics of k"),
            "mesh_stiffness_amplitude_noise_floor": Quantity(
                "N/µm", "ε(k_n)", "numerical noise floor of the amplitudes of the harmonics of k"
            ),
            "mesh_stiffness_phase": Quantity("rad", "arg k_n", "phases of the harmonics of k"),
        },
        "of a train whose meshes are one problem": {
            "mesh": Quantity("1", "", "name of the mesh"),
            "phase_shift": Quantity("1", "φ", "mesh phase when that of the first mesh is 0"),
            "member": Quantity("1", "", "name of the shaft, or of the carrier"),
            "axis": Quantity("1", "", "direction in the transverse plane"),
            "motion": Quantity("1", "", "free motion beside the turning of the shafts"),
            "mesh_load": Quantity("N", "F_bt", "force of the mesh along the line of action, transverse"),
            "load_sharing": Quantity("1", "L", "force of the mesh over that where all paths share alike"),
            "revolution": Quantity("1", "", "turn of the carrier against the ring"),
            "load_sharing_over_revolution": Quantity("1", "L", "greatest load share over the mesh cycle at each turn"),
            "load_sharing_greatest": Quantity("1", "L", "greatest load share of a mesh over the cycle"),
            "train_transmission_error": Quantity("µm", "Δ", "transmission error of the train on the first base circle"),
            "train_transmission_error_amplitude": Quantity("µm", "|Δ_n|", "amplitudes of the harmonics of Δ"),
            "train_transmission_error_phase": Quantity("rad", "arg Δ_n", "phases of the harmonics of Δ"),
            "turning_error": Quantity("µrad", "Δθ", "Δ as an angle of a member that torque enters or leaves"),
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
            "mesh_stiffness_order_amplitude": Quantity("N/µm", "|k_ν|", "amplitudes of the orders of k"),
        },
        "on the flank": {
            "flank_pressure": Quantity("MPa", "p", "Hertz pressure of a segment"),
            "flank_pressure_max": Quantity("MPa", "max p", "largest Hertz pressure over the mesh cycle"),
            "specific_sliding": Quantity("1", "ζ", "specific sliding"),
            "sliding_speed": Quantity("m/s", "v_g", "sliding speed, positive where the pinion's flank is the faster"),
            "flash_temperature": Quantity("K", "Θ_fl", "flash temperature"),
            "flash_temperature_max": Quantity("K", "max Θ_fl", "largest flash temperature over the mesh cycle"),
            "face_load_factor": Quantity("1", "K_Hβ", "largest over mean load of the face"),
            "loaded_contact_ratio": Quantity("1", "ε_load", "mean number of tooth pairs that carry load"),
            "root_stress": Quantity("MPa", "σ_F0", "nominal root stress"),
            "loaded_root_stress": Quantity("MPa", "σ_F", "root stress from the load found"),
            "friction_coefficient": Quantity("1", "μ", "coefficient of friction of the mesh"),
            "friction_loss": Quantity("W", "P_VZ", "friction loss of the mesh"),
            "mesh_efficiency": Quantity("1", "η_z", "efficiency of the mesh"),
        },
        "limits of a design": {
            "tip_room": Quantity("mm", "g_a", "room between tips of ring and pinion off the path of contact"),
            "radial_room": Quantity("mm", "g_r", "room between tips where a pinion is pushed into its ring radially"),
            "form_room": Quantity("mm", "g_F", "least length of the path of contact between fillets and mates' tips"),
            "total_contact_ratio": Quantity("1", "ε_γ", "total contact ratio"),
            "transverse_contact_ratio": Quantity("1", "ε_α", "transverse contact ratio"),
            "overlap_ratio": Quantity("1", "ε_β", "overlap ratio"),
            "contact_pressure": Quantity("MPa", "σ_H", "largest contact pressure"),
            "gear_ratio": Quantity("1", "u", "ratio of the numbers of teeth"),
            "mass": Quantity("kg", "m", "mass of both gears"),
            "cost": Quantity("1", "", "what the values of the variables cost"),
        },
        "comparison with a reference": {
            "load_share_error_max": Quantity("1", "max |ΔX|", "largest difference of the share of a pair"),
            "load_share_error_rms": Quantity("1", "RMS ΔX", "RMS difference of the share of a pair, while in contact"),
            "load_radius": Quantity("mm", "R", "radius of the load"),
            "load_position": Quantity("mm", "y", "position of the load along the face width"),
            "mac": Quantity("1", "MAC", "modal assurance criterion of the deflection shapes under one load"),
            "mac_worst": Quantity("1", "min MAC", "worst modal assurance criterion of all loads"),
            "mac_mean": Quantity("1", "mean MAC", "mean modal assurance criterion of all loads"),
            "line_mac_worst": Quantity("1", "min MAC_l", "worst modal assurance criterion under a contact line"),
            "line_mac_mean": Quantity("1", "mean MAC_l", "mean modal assurance criterion under contact lines"),
            "norm_ratio": Quantity("1", "‖w‖/‖w_ref‖", "deflection over that of the reference, under one load"),
            "compliance_ratio": Quantity("1", "‖C‖/‖C_ref‖", "compliance over that of the reference, all loads"),
            "reference_error": Quantity("1", "η", "estimated relative error of the reference's compliance"),
            "reference_unknowns": Quantity("1", "N", "unknowns of the reference's finest level"),
            "reference_meshes": Quantity("1", "n", "levels that the reference was refined over"),
            "reference_seconds": Quantity("s", "t", "wall time of the reference's compliance, all its levels"),
            "reference_settled": Quantity("1", "–", "whether the reference is five times better than what it judges"),
            "reference_cached": Quantity("1", "–", "whether the reference was computed earlier and kept"),
            "compliance_seconds": Quantity("s", "t_C", "wall time of the smooth compliance of an unseen pair"),
            "simulation_seconds": Quantity("s", "t_S", "wall time of a simulation, the teeth being known"),
            "first_call_seconds": Quantity("s", "t_1", "wall time of the fast model's first simulation in its process"),
        },
        "cost of accuracy": {
            "setting_error": Quantity("1", "ε", "relative error that a setting leaves"),
            "setting_error_bar": Quantity("1", "Δε", "uncertainty of the reference of that error"),
            "seconds": Quantity("s", "t", "wall time of a run, median of repeats"),
            "processor_seconds": Quantity("s", "t_p", "processor time of a run, median of repeats"),
            "megabytes": Quantity("MB", "M", "largest memory taken during a run"),
            "observed_order": Quantity("1", "p", "observed order of convergence"),
            "compliance_error": Quantity("1", "ε_C", "relative error of the flank compliance, of the worse gear"),
            "compliance_error_bar": Quantity("1", "Δε_C", "uncertainty of the reference of that error"),
            "compliance_order": Quantity("1", "p_C", "observed order of convergence of the flank compliance"),
            "unknowns": Quantity("1", "N", "unknowns of the larger of both meshes"),
        },
        "over speed": {
            "speed": Quantity("1/min", "n", "speed of the pinion"),
            "mesh_frequency": Quantity("Hz", "f_z", "mesh frequency"),
            "dynamic_transmission_error_amplitude": Quantity(
                "µm", "x_n", "amplitude of an order of the dynamic transmission error"
            ),
            "dynamic_transmission_error_phase": Quantity(
                "rad", "arg x_n", "phase of an order of the dynamic transmission error"
            ),
            "dynamic_transmission_error_rms": Quantity(
                "µm", "RMS x", "RMS of the fluctuating dynamic transmission error"
            ),
            "mesh_force_amplitude": Quantity("N", "f_n", "amplitude of a mesh force order, along the line of action"),
            "mesh_force_by_source_amplitude": Quantity(
                "N", "f_n", "amplitude of a mesh force order of the frequency of the mesh that excites it"
            ),
            "mesh_force_combination_amplitude": Quantity(
                "N", "f_nm", "amplitude of the mesh force at a combination of orders of two mesh frequencies"
            ),
            "combination_residual": Quantity("1", "–", "residual of the balance of all mesh frequencies"),
            "combination_frequency": Quantity("Hz", "|n f_1 + m f_2|", "frequency of a combination"),
            "mesh_force_phase": Quantity("rad", "arg f_n", "phase of a mesh force order"),
            "mesh_force_rms": Quantity("N", "RMS f", "RMS of the fluctuating mesh force, of all mesh frequencies"),
            "mean_force": Quantity("N", "F_bt", "mean mesh force along the line of action"),
            "mesh_force_percentile": Quantity(
                "N", "RMS f", "percentile of the RMS of the mesh force over error samples"
            ),
            "mesh_force_rms_mean": Quantity("N", "mean RMS f", "mean of the RMS of the mesh force over error samples"),
            "mesh_force_rms_std": Quantity(
                "N", "σ RMS f", "standard deviation of the RMS of the mesh force over samples"
            ),
            "mesh_force_rms_max": Quantity("N", "max RMS f", "largest RMS of the mesh force of all error samples"),
            "dynamic_factor": Quantity("1", "max f/F_bt", "largest over mean mesh force, frequencies in any phase"),
            "contact_kept": Quantity("1", "f > 0", "whether the flanks never part"),
            "floquet_multiplier": Quantity(
                "1",
                "max |μ|",
                "largest Floquet multiplier; stable below 1, NaN where proven without it",
            ),
            "bearing_load": Quantity("N", "B", "mean force of a shaft on its bearing"),
            "bearing_force_amplitude": Quantity("N", "B_n", "amplitude of a bearing force order"),
            "bearing_force_phase": Quantity("rad", "arg B_n", "phase of a bearing force order"),
            "housing_amplitude": Quantity("1", "y_n", "amplitude of an order at a point of the housing"),
            "housing_phase": Quantity("rad", "arg y_n", "phase of an order at a point of the housing"),
            "periods": Quantity("1", "–", "mesh periods after which the motion repeats, 0 where it does not"),
            "natural_frequency": Quantity("Hz", "f_r", "natural frequency with the mean mesh stiffness"),
            "mode_participation": Quantity("1", "–", "share of a mode in the static compliance at a mesh"),
            "critical_speed": Quantity("1/min", "n_E", "speed at which an order of the mesh frequency meets a mode"),
        },
        "random errors": {
            "error": Quantity("µm", "ε", "manufacturing error drawn; phases in °, other keys in their own unit"),
            "backlash": Quantity("mm", "j_wt", "circumferential backlash of each sample at the working pitch circles"),
            "tightening_cost": Quantity("1", "", "what one class finer of an error's tolerance costs"),
        },
        "how well the contact is solved": {
            "equilibrium_residual": Quantity("1", "|ΣP−F|/F", "relative residual of the force balance"),
            "minimum_force": Quantity("1", "min P/F", "least segment force over the normal force"),
            "complementarity_residual": Quantity("1", "max|min(P,g)|", "residual of the contact conditions"),
            "newton_steps": Quantity("1", "n", "steps of the contact solver"),
        },
        "an optimisation": {
            "code": Quantity(
                "1",
                "",
                "index into the grid of a variable's values, or its value where it is real",
            ),
            "objective": Quantity("1", "", "objectives, to be made small"),
            "objective_before": Quantity("1", "", "objectives before the design was polished"),
            "violation": Quantity("1", "", "sum of the relative violations of the limits"),
            "feasible": Quantity("1", "", "whether the design keeps all limits"),
            "reason": Quantity("1", "", "why the design is not feasible"),
            "evaluated_samples": Quantity("1", "n", "error samples that the design was judged by"),
            "first_generation": Quantity("1", "", "generation in which the design was first asked for"),
            "on_front": Quantity("1", "", "whether no feasible design dominates this one"),
            "in_population": Quantity("1", "", "whether the design survived the last generation"),
            "asked": Quantity("1", "", "designs the search asked for"),
            "asked_design": Quantity("1", "", "designs that the search asked for; -1 beyond their number"),
            "evaluated": Quantity("1", "", "designs that were computed, and not known before"),
            "feasible_found": Quantity("1", "", "feasible designs known so far"),
            "hypervolume": Quantity("1", "", "share of the box below the reference point that the front dominates"),
            "reference_point": Quantity("1", "", "reference point of the hypervolume"),
            "number": Quantity("1", "", "index in the dimension design of the stored optimisation"),
            "shift": Quantity("%", "", "change of the objective by the compliance of the reference"),
            "verified": Quantity("1", "", "whether the reference gave an answer"),
            "rank_correlation": Quantity("1", "", "rank correlation (Spearman) with both compliances"),
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
