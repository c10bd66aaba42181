"""Quantities of the loaded flank: pressure, sliding, friction, flash temperature, face load factor, root stress.

Arrays of the solution may have further dimensions before the position, (…, position, pair, segment); results then have
them too. Speeds follow from the kinematics of the involute, loads from the contact solution (F1–F6 of
docs/theory.md).
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.results.solved import Solved
from gearbench.scene import Operation
from gearbench.strength.bending import RootBending
from gearbench.strength.rating import contact_pressure

#: Blok's factor: flash temperature of a fast moving heat source with semi-elliptical flux, over that of its mean flux
#: [–] (F5).
BLOK = 1.11
#: Limits in the friction coefficient of ISO/TR 14179-2: least line load [N/mm], largest pitch line speed [m/s].
LEAST_LOAD, LARGEST_SPEED = 150.0, 50.0
#: Number of strips of the face whose loads are compared.
FACE_PARTS = 20


def pressure(solved: Solved) -> NDArray:
    """Largest Hertz pressure of the segments (F4), (…, position, pair, segment) [MPa]."""
    return contact_pressure(solved.lines, solved.solution.force / solved.lines.lever)


def root_stress(solved: Solved) -> NDArray:
    """Nominal root stress of both gears, ISO 6336-3:2019 method B, (…, gear) [MPa]."""
    per_torque = [RootBending(pair=solved.scene.pair, gear=index).stress(1.0) for index in (0, 1)]
    return np.multiply.outer(_torque(solved), per_torque)


def loaded_root_stress(solved: Solved) -> NDArray:
    """Largest root stress of both gears over the mesh cycle, from the computed load distribution (F9), (…, gear) [MPa].

    Y_F and Y_S of ISO 6336-3:2019 are taken at the height of every segment's load, on the virtual spur tooth. Along the
    face, the stress is averaged over one tooth height to both sides; this is our assumption, not part of the standard.
    """
    return np.stack([_loaded_root_stress(solved, index) for index in (0, 1)], axis=-1)


def _loaded_root_stress(solved: Solved, index: int) -> NDArray:
    pair, lines = solved.scene.pair, solved.lines
    gear, b = pair.gears[index], pair.meshing.face_width
    bending = RootBending(pair=pair, gear=index)
    radius = np.where(lines.length > 0, np.hypot(gear.base_radius, lines.rolls[index]), gear.tip_radius)
    # F_t = F_bn cos α_n cos β for every segment
    tangential = solved.solution.force / lines.lever * math.cos(gear.alpha_n) * math.cos(gear.beta)
    moment, end = tangential * bending.loaded(radius), _ends(solved)
    begin = end - lines.length * math.cos(pair.meshing.beta_b)
    width = np.where(lines.length > 0, end - begin, 1.0)
    by_gear = []
    for middle in np.linspace(0.0, b, FACE_PARTS + 1):
        low, high = max(middle - gear.tooth_height, 0.0), min(middle + gear.tooth_height, b)
        share = np.clip(np.minimum(end, high) - np.maximum(begin, low), 0.0, None) / width
        by_gear.append((moment * share).sum(axis=-1).max(axis=(-1, -2)) / (high - low))
    return np.max(by_gear, axis=0) / pair.normal_module * bending.rim_factor


def specific_sliding(solved: Solved) -> NDArray:
    """ζ_1 = 1 − v_2/v_1 of the pinion, ζ_2 = 1 − v_1/v_2 of the wheel (F1), (gear, position, pair, segment) [–]."""
    v = np.stack(_speeds(solved))
    with np.errstate(divide="ignore", invalid="ignore"):  # −∞ where a flank touches at its base circle
        return 1 - v[::-1] / v


def sliding_speed(solved: Solved) -> NDArray:
    """v_g = v_1 − v_2 along the profile, (position, pair, segment) [m/s]; positive where the pinion is faster.

    Raises
    ------
    InputError
        If the scene has no ``operation.speed``.
    """
    v_1, v_2 = _speeds(solved)
    return 1e-3 * _omega(solved, "sliding_speed") * (v_1 - v_2)


def friction_coefficient(solved: Solved) -> NDArray:
    """μ of the mesh, given by the scene or by ISO/TR 14179-2 (F3) [–].

    Raises
    ------
    InputError
        If the scene has neither ``operation.friction_coefficient`` nor speed and viscosity.
    """
    operation = _operation(solved, "friction_coefficient")
    if operation.friction_coefficient is not None:
        return np.full_like(_force(solved), operation.friction_coefficient)
    if operation.viscosity is None:
        raise InputError("operation.viscosity", "missing", "is required for friction, or friction_coefficient")
    pair, meshing = solved.scene.pair, solved.scene.pair.meshing
    v_t = 1e-3 * _omega(solved, "friction_coefficient") * pair.gears[0].base_radius / math.cos(meshing.alpha_wt)
    v_sum = 2 * min(v_t, LARGEST_SPEED) * math.sin(meshing.alpha_wt)
    rho = float(meshing.curvature_radius(np.array(meshing.pitch_point)))
    w = np.maximum(_force(solved) * math.cos(meshing.beta_b) / pair.meshing.face_width, LEAST_LOAD)
    eta, Ra, X_L = operation.viscosity, operation.roughness, operation.lubricant_factor
    return 0.048 * (w / (v_sum * rho)) ** 0.2 * eta**-0.05 * Ra**0.25 * X_L


def efficiency(solved: Solved) -> NDArray:
    """Efficiency of the mesh over the cycle, 1 − loss/power [–]; independent of speed if μ is given."""
    v_1, v_2 = _speeds(solved)
    P = solved.solution.force / solved.lines.lever
    lost = (P * np.abs(v_1 - v_2)).sum(axis=(-1, -2)) @ solved.weight
    return 1 - friction_coefficient(solved) * lost / (1e3 * _torque(solved))


def friction_loss(solved: Solved) -> NDArray:
    """Mean over the cycle of Σ μ P |v_g| (F2) [W]."""
    omega = _omega(solved, "friction_loss")
    return (1 - efficiency(solved)) * _torque(solved) * omega


def flash_temperature(solved: Solved) -> NDArray:
    """Temperature rise in the contact after Blok (F5), (…, position, pair, segment) [K].

    1.11 μ q |v_1 − v_2| / (√(2b_H) (B_M √v_1 + B_M √v_2)) with the half-width of contact b_H, ISO/TR 13989-1.
    """
    operation = _operation(solved, "flash_temperature")
    v_1, v_2 = (np.maximum(_omega(solved, "flash_temperature") * v, 0.0) for v in _speeds(solved))  # mm/s
    q, p = solved.line_load(), pressure(solved)
    width = 4 * q / (math.pi * np.where(p > 0, p, 1.0))  # 2 b_H, since q = π/2 p b_H
    mu = friction_coefficient(solved)[..., None, None, None]
    # in N/(mm s^½ K); 1 N/(m s^½ K) is a thousandth of that
    B_M = operation.thermal_contact_coefficient
    rolling = np.sqrt(v_1) + np.sqrt(v_2)
    cooled = B_M * np.sqrt(width) * rolling
    rise = BLOK * mu * q * np.abs(v_1 - v_2) / np.where(cooled > 0, cooled, 1.0)
    return np.where(cooled > 0, rise, 0.0)


def face_load_factor(solved: Solved) -> NDArray:
    """Face load factor K_Hβ (F6), (…) [–]: largest over mean load per width of the face; NaN without load.

    The load per width is averaged over the mesh cycle in ``FACE_PARTS`` strips.
    """
    lines = solved.lines
    P, end = solved.solution.force / lines.lever, _ends(solved)
    begin = end - lines.length * math.cos(solved.scene.pair.meshing.beta_b)
    width = np.where(lines.length > 0, end - begin, 1.0)
    edges = np.linspace(0.0, solved.scene.pair.meshing.face_width, FACE_PARTS + 1)
    parts = []
    for low, high in pairwise(edges):
        share = np.clip(np.minimum(end, high) - np.maximum(begin, low), 0.0, None) / width
        parts.append((P * share).sum(axis=(-1, -2)) @ solved.weight)
    load = np.stack(parts, axis=-1)
    mean = load.mean(axis=-1)
    return load.max(axis=-1) / np.where(mean > 0, mean, np.nan)


def _ends(solved: Solved) -> NDArray:
    """Upper ends y of the segments, (position, pair, segment) [mm]; the weight of a Gauss point gives its width."""
    lines, meshing = solved.lines, solved.scene.pair.meshing
    width = lines.length * math.cos(meshing.beta_b)
    first = lines.y[..., 0] - width[..., 0] / 2
    if not lines.cells:
        tan_b = math.tan(meshing.beta_b)
        before = meshing.path_start - (lines.u - lines.y * tan_b)[..., 0]
        first = np.clip(before / tan_b, 0.0, solved.scene.pair.meshing.face_width) if tan_b else np.zeros_like(first)
    return first[..., None] + np.cumsum(width, axis=-1)


def loaded_contact_ratio(solved: Solved) -> NDArray:
    """Mean number of tooth pairs that carry load [–]; the total contact ratio if no flanks lose contact."""
    carrying = solved.solution.force.sum(axis=-1) > 0
    return carrying.sum(axis=-1) @ solved.weight


def _force(solved: Solved) -> NDArray:
    """Total normal force F_bn of the solution, (…,) [N]."""
    return solved.solution.force.sum(axis=(-1, -2)).mean(axis=-1)


def _torque(solved: Solved) -> NDArray:
    """Torque T on the pinion without its sign, (…,) [N·m]."""
    pair = solved.scene.pair
    return 1e-3 * _force(solved) * math.cos(pair.meshing.beta_b) * pair.gears[0].base_radius


def _speeds(solved: Solved) -> tuple[NDArray, NDArray]:
    """Speeds of both flanks along the profile at 1 rad/s of the pinion, (position, pair, segment) [mm/s]."""
    first, second = solved.lines.rolls
    z_1, z_2 = (gear.teeth for gear in solved.scene.pair.gears)
    return first, second * z_1 / z_2


def _operation(solved: Solved, name: str) -> Operation:
    if solved.scene.operation is None:
        raise InputError("operation", "missing", f"is required for {name}: speed, and friction or lubricant")
    return solved.scene.operation


def _omega(solved: Solved, name: str) -> float:
    """Angular speed of the pinion [rad/s]."""
    speed = _operation(solved, name).speed
    if speed is None:
        raise InputError("operation.speed", "missing", f"is required for {name}")
    return speed * math.pi / 30
