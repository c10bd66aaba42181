"""Names, units and symbols of everything a Dataset may hold: one table for programs, plots and documentation."""

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
    def attrs(self) -> dict[str, str]:
        """As attributes of an xarray variable."""
        return {"units": self.units, "symbol": self.symbol, "long_name": self.long_name}


QUANTITIES: Mapping[str, Quantity] = MappingProxyType(
    {
        # coordinates
        "mesh_phase": Quantity("1", "τ", "mesh phase"),
        "phase_weight": Quantity("1", "w", "weight of the mesh phase in means over the mesh cycle"),
        "pair_index": Quantity("1", "k", "number of the tooth pair"),
        "path_position": Quantity("mm", "u", "place on the path of contact, from the pinion's interference point"),
        "face_position": Quantity("mm", "y", "place along the face width"),
        "segment_length": Quantity("mm", "ℓ", "length of a segment along the contact line"),
        # over the mesh cycle
        "transmission_error": Quantity("µm", "δ", "static transmission error along the line of action"),
        "mesh_stiffness": Quantity("N/µm", "k", "mesh stiffness"),
        "line_load": Quantity("N/mm", "q", "line load"),
        "load_share": Quantity("1", "X", "share of the load on a tooth pair"),
        "initial_gap": Quantity("µm", "e", "initial gap from micro-geometry and errors"),
        # one number per cycle
        "transmission_error_mean": Quantity("µm", "mean δ", "mean static transmission error"),
        "transmission_error_rms": Quantity("µm", "RMS δ", "RMS of the fluctuating static transmission error"),
        "transmission_error_peak_to_peak": Quantity("µm", "PP δ", "peak-to-peak static transmission error"),
        "mesh_stiffness_mean": Quantity("N/µm", "mean k", "mean mesh stiffness"),
        "mesh_stiffness_rms": Quantity("%", "RMS k", "RMS of the relative fluctuation of the mesh stiffness"),
        "mesh_stiffness_peak_to_peak": Quantity("N/µm", "PP k", "peak-to-peak mesh stiffness"),
        # limits of a design
        "total_contact_ratio": Quantity("1", "ε_γ", "total contact ratio"),
        "transverse_contact_ratio": Quantity("1", "ε_α", "transverse contact ratio"),
        "overlap_ratio": Quantity("1", "ε_β", "overlap ratio"),
        "specific_sliding": Quantity("1", "ζ", "largest specific sliding"),
        "contact_pressure": Quantity("MPa", "σ_H", "largest contact pressure"),
        "root_stress": Quantity("MPa", "σ_F", "largest nominal root stress"),
        # comparison with a reference
        "transmission_error_harmonic": Quantity("µm", "δ_n", "amplitude of a harmonic of the transmission error"),
        "mesh_stiffness_harmonic": Quantity("N/µm", "k_n", "amplitude of a harmonic of the mesh stiffness"),
        "load_share_error_max": Quantity("1", "max |ΔX|", "largest difference of the share of a pair"),
        "load_share_error_rms": Quantity("1", "RMS ΔX", "RMS difference of the share of a pair, while in contact"),
        "load_radius": Quantity("mm", "R", "radius where the load stands"),
        "load_position": Quantity("mm", "y", "place along the face width where the load stands"),
        "mac": Quantity("1", "MAC", "modal assurance criterion of the deflection shapes under one load"),
        "mac_worst": Quantity("1", "min MAC", "worst modal assurance criterion of all loads"),
        "mac_mean": Quantity("1", "mean MAC", "mean modal assurance criterion of all loads"),
        "line_mac_worst": Quantity("1", "min MAC_l", "worst modal assurance criterion under a contact line"),
        "line_mac_mean": Quantity("1", "mean MAC_l", "mean modal assurance criterion under contact lines"),
        "norm_ratio": Quantity("1", "‖w‖/‖w_ref‖", "deflection over that of the reference, under one load"),
        "compliance_ratio": Quantity("1", "‖C‖/‖C_ref‖", "compliance over that of the reference, all loads"),
        "reference_error": Quantity("1", "η", "estimated relative error of the reference's compliance"),
        "reference_unknowns": Quantity("1", "N", "unknowns of the reference's finest mesh"),
        "reference_meshes": Quantity("1", "n", "meshes that the reference was refined over"),
        "reference_seconds": Quantity("s", "t", "wall time of the reference's compliance, all its meshes"),
        "reference_cached": Quantity("1", "–", "whether the reference was computed earlier and kept"),
        "compliance_seconds": Quantity("s", "t_C", "wall time of the smooth compliance of an unseen pair"),
        "simulation_seconds": Quantity("s", "t_S", "wall time of a simulation, the teeth being known"),
        "first_call_seconds": Quantity("s", "t_1", "wall time of the fast model's first simulation in its process"),
        # what accuracy costs
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
        # over speed
        "speed": Quantity("1/min", "n", "speed of the pinion"),
        "harmonic": Quantity("1", "n", "order of the mesh frequency"),
        "mesh_frequency": Quantity("Hz", "f_z", "mesh frequency"),
        "dynamic_transmission_error_amplitude": Quantity(
            "µm", "x_n", "amplitude of a dynamic transmission error order"
        ),
        "dynamic_transmission_error_phase": Quantity("rad", "arg x_n", "phase of a dynamic transmission error order"),
        "dynamic_transmission_error_rms": Quantity("µm", "RMS x", "RMS of the fluctuating dynamic transmission error"),
        "mesh_force_amplitude": Quantity("N", "f_n", "amplitude of a mesh force order, along the line of action"),
        "mesh_force_phase": Quantity("rad", "arg f_n", "phase of a mesh force order"),
        "mesh_force_rms": Quantity("N", "RMS f", "RMS of the fluctuating mesh force"),
        "mean_force": Quantity("N", "F_bt", "mean mesh force along the line of action"),
        "mesh_force_percentile": Quantity("N", "RMS f", "percentile of the RMS of the mesh force over error samples"),
        "mesh_force_rms_mean": Quantity("N", "mean RMS f", "mean of the RMS of the mesh force over error samples"),
        "mesh_force_rms_std": Quantity("N", "σ RMS f", "standard deviation of the RMS of the mesh force over samples"),
        "mesh_force_rms_max": Quantity("N", "max RMS f", "largest RMS of the mesh force of all error samples"),
        "mesh_force_rms_overall": Quantity("N", "RMS f", "RMS of the mesh force over the range of speeds"),
        "mesh_force_mean": Quantity("N", "m_f", "mean over the samples of the RMS of the mesh force over speed"),
        "mesh_force_std": Quantity("N", "σ_f", "standard deviation of the RMS of the mesh force over speed"),
        "mesh_force_max": Quantity("N", "M_f", "largest RMS of the mesh force over speed of all samples"),
        "dynamic_factor": Quantity("1", "max f/F_bt", "largest over mean mesh force"),
        "contact_kept": Quantity("1", "f > 0", "whether the flanks never part"),
        "floquet_multiplier": Quantity("1", "max |μ|", "largest Floquet multiplier; stable where below 1"),
        "bearing_force_amplitude": Quantity("N", "B_n", "amplitude of a bearing force order"),
        "bearing_force_phase": Quantity("rad", "arg B_n", "phase of a bearing force order"),
        "branches": Quantity("1", "–", "periodic responses at a speed, stable or not"),
        "natural_frequency": Quantity("Hz", "f_r", "natural frequency with the mean mesh stiffness"),
        "mode_participation": Quantity("1", "–", "share of a mode in the static compliance at a mesh"),
        "critical_speed": Quantity("1/min", "n_E", "speed at which an order of the mesh frequency meets a mode"),
        # random errors
        "error": Quantity("µm", "ε", "manufacturing error drawn"),
        # how well the contact is solved
        "equilibrium_residual": Quantity("1", "|ΣP−F|/F", "relative residual of the force balance"),
        "minimum_force": Quantity("1", "min P/F", "least segment force over the normal force"),
        "complementarity_residual": Quantity("1", "max|min(P,g)|", "residual of the contact conditions"),
        "newton_steps": Quantity("1", "n", "steps of the contact solver"),
    }
)
