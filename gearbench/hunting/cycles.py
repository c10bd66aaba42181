"""Contact over all mesh cycles until the same teeth meet again: sidebands of pitch errors, run-out and waviness.

Mesh cycles differ only in their gaps. Compliance and contact lines are computed once, and each cycle is one gap vector
for the batch solver. The solver starts from the solution without the errors and its derivatives. Nothing is linearised:
every cycle is solved to the same residual as a single contact problem.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import ORDERS_AT_ONCE, cycles_memory, order_memory, require, room
from gearbench.contact.batch import Batch, GapModes, chunks, on_threads, solve_one_chunk
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.size import contact_memory
from gearbench.effects.base import GapEffect, GapOverCycles
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.gear import Gear
from gearbench.results.cycle import MeshCycle, Phases, fourier_rows
from gearbench.scene import Scene
from gearbench.schema import changed

#: Largest number of mesh cycles.
MOST_CYCLES = 100_000
#: Default highest mesh order of a spectrum.
ORDERS = 3.0
#: Peak memory of solving the contact over the memory of one contact problem: the problem on cells and its correction on
#: patches exist together.
CONTACT_SHARE = 2.5


def known_orders(phases: Phases, cycles: int, orders: float) -> int:
    """Number of orders that are known: multiples of 1/``cycles`` up to ``orders``.

    With uniform phases only orders below half the number of phases are known.

    Raises
    ------
    InputError
        If no order is known.
    """
    if not orders * cycles + 1e-9 >= 1:
        raise InputError(
            "orders", orders, f"must be at least {1 / cycles:.3g}: the same teeth meet after {cycles} mesh cycles"
        )
    known = math.floor(orders * cycles * phases.length + 1e-9)
    if phases.size is None:
        known = min(known, (cycles * len(phases.phase) - 1) // 2)
        if not known:
            raise InputError("resolution.positions", len(phases.phase), "must be 3 or more: fewer give no order")
    return known


def hunting_memory(scene: Scene, positions: int, cycles: int, orders: float, modes: int) -> float:
    """Peak memory [bytes] of mesh cycles with ``modes`` gap modes and of their spectrum up to mesh order ``orders``."""
    # uniform phases resolve only orders below half their number
    highest = orders if scene.resolution.positions is None else min(orders, positions / 2)
    return cycles_memory(positions, cycles, highest, modes) + CONTACT_SHARE * contact_memory(scene, positions)


def require_cycles_memory(
    scene: Scene, effects: Sequence[GapEffect], positions: int, cycles: int, orders: float
) -> None:
    """Refuse mesh cycles that need more memory than allowed; ``effects`` are those that differ between the cycles.

    Raises
    ------
    MemoryBudgetError
        With numbers of positions or orders that would fit.
    """
    modes = cycle_gap_amounts(effects, scene_lines(scene, np.zeros(1)), 1).shape[-1]
    needed, limit = hunting_memory(scene, positions, cycles, orders, modes), room()
    per_position = hunting_memory(scene, positions + 1, cycles, orders, modes) - needed
    fewer = int((limit - needed) / per_position + positions)
    lower = orders - (needed - limit) / (order_memory() * cycles)
    instead = [f"{fewer} positions"] * (fewer > 0) + [f"{math.floor(10 * lower) / 10:g} orders"] * (lower >= 0.1)
    value = f"{cycles} mesh cycles × {positions} positions, {orders:g} orders of the mesh"
    require(needed, "hunting", value, f"{' or '.join(instead) or 'nothing'} would fit")


def check_cycles(gears: Sequence[Gear], key: str = "pair.wheel.teeth", passed: Sequence[int] = (1, 1)) -> int:
    """Number of mesh cycles until the same teeth of ``gears`` meet again.

    ``passed`` is the number of teeth of each gear that pass in a cycle, ``key`` the key named in the error.

    Raises
    ------
    InputError
        If there are more than ``MOST_CYCLES``.
    """
    count = math.lcm(*(g.teeth // math.gcd(g.teeth, n) for g, n in zip(gears, passed, strict=True)))
    if count > MOST_CYCLES:
        allowed = f"{count} mesh cycles until the same teeth meet: at most {MOST_CYCLES}"
        raise InputError(key, gears[-1].teeth, allowed)
    return count


@lru_cache(maxsize=64)
def tooth_to_tooth_effects(scene: Scene) -> tuple[GapEffect, ...]:
    """Effects of the loaded flank whose gap changes from mesh cycle to mesh cycle."""
    lines, first_cycle = scene_lines(scene, np.zeros(1)), np.zeros(1, dtype=int)
    gaps = (effect for effect in scene.flank_effects if isinstance(effect, GapEffect))
    return tuple(effect for effect in gaps if effect.turning(lines, first_cycle) is not None)


def with_equal_teeth(scene: Scene) -> Scene:
    """Return the scene without the effects that change from mesh cycle to mesh cycle."""
    differing = tooth_to_tooth_effects(scene)
    effects, coast = (tuple(e for e in flanks if e not in differing) for flanks in (scene.effects, scene.coast))
    train = scene.train and replace(scene.train, first=(scene.pair, effects, coast, scene.system))
    return changed(scene, effects=effects, coast=coast, train=train) if differing else scene


def cycle_gap_modes(effects: Sequence[GapEffect], lines: ContactLines) -> GapModes:
    """Gap modes of the effects; all mesh cycles have the same modes."""
    return GapModes.on(
        lines, lambda lines: np.concatenate([p.modes for p in _gaps_over_cycles(effects, lines, 1)], axis=-1)
    )


def cycle_gap_amounts(effects: Sequence[GapEffect], lines: ContactLines, count: int) -> NDArray:
    """Amplitudes of the gap modes in the first ``count`` mesh cycles, (cycle, mode)."""
    return np.concatenate([part.amounts for part in _gaps_over_cycles(effects, lines, count)], axis=-1)


def _gaps_over_cycles(effects: Sequence[GapEffect], lines: ContactLines, count: int) -> list[GapOverCycles]:
    """Gaps of the effects in the first ``count`` mesh cycles; a single mode of zeros if no effect changes."""
    gaps = (effect.turning(lines, np.arange(count)) for effect in effects)
    unchanged = GapOverCycles(modes=np.zeros((*lines.shape, 1)), amounts=np.zeros((count, 1)))
    return [part for part in gaps if part is not None] or [unchanged]


def solve_cycles(scene: Scene, phases: Phases, batch: Batch, amounts: NDArray, threads: int) -> MeshCycle:
    """Transmission error and stiffness, (cycle, position), of cycles with gap amplitudes ``amounts`` (cycle, mode)."""
    parts = list(on_threads(partial(solve_one_chunk, batch), chunks(amounts), threads))
    approach, stiffness = (
        np.concatenate([getattr(part, name) for part in parts], axis=1).T[: len(amounts)]
        for name in ("approach", "stiffness")
    )
    return MeshCycle.of(scene, phases, approach, stiffness)


def order_coefficients(phases: Phases, values: NDArray, count: int) -> NDArray:
    """Fourier coefficients c_ν (F8) of ``values`` (cycle, position) for the orders ν = 1/N … count/N, (order,).

    N is the number of mesh cycles. c_{q/N} = 1/N Σ_n e^{−2πi q n/N} ∫₀¹ x_n(τ) e^{−2πi (q/N) τ} dτ is computed in
    two steps: a Fourier transform over the cycles at each mesh phase, whose result repeats after N orders, and an
    integral over the phase. With uniform phases, orders from half the number of all points on are meaningless.
    """
    N, q = len(values), np.arange(1, count + 1)
    by_phase, parts = np.fft.fft(values, axis=0) / N, -(-count // ORDERS_AT_ONCE)
    waves_of_orders = ((part, _waves(phases, part / (N * phases.length))) for part in np.array_split(q, parts))
    coefficients = [np.einsum("qp,qp->q", waves, by_phase[part % N]) for part, waves in waves_of_orders]
    return np.concatenate(coefficients)


def _waves(phases: Phases, order: NDArray) -> NDArray:
    """Matrix (order, position) that maps values x at the phases of a mesh cycle to ∫₀¹ x(τ) e^{−2πiντ} dτ."""
    if phases.size is None:
        return np.exp(-2j * np.pi * np.outer(order, phases.phase)) / len(phases.phase)
    return fourier_rows(phases, order)
