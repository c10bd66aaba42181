"""All mesh cycles until the same teeth meet again: pitch errors, run-out and waves, with the side bands that follow.

Mesh cycles differ in their gaps alone. Compliance and contact lines are made once; each cycle is a gap vector of the
batch solver, which starts from the solution without the errors and its derivatives. So every neighbourhood of teeth is
solved for itself, to the residual of any contact solution: nothing is linearised.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import ORDERS_AT_ONCE, cycles_memory, order_memory, require, room
from gearbench.contact.assemble import assemble
from gearbench.contact.batch import Batch, GapModes, chunks, on_threads, prepare, solve_one_chunk
from gearbench.contact.look import scene_lines
from gearbench.contact.size import contact_memory
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.base import GapEffect, Turning
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.results.cycle import MeshCycle, Phases, fourier_rows
from gearbench.results.origin import keeping
from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.scene import Scene, check_scene
from gearbench.threads import single_threaded_blas

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Mesh cycles at most.
MOST_CYCLES = 100_000
#: Highest mesh order of a spectrum unless told otherwise.
ORDERS = 3.0
#: Decades that a figure shows below the largest amplitude.
DECADES = 4
#: Contact problems at the same time: that on cells, and that on patches, which says what cells miss.
OF_CONTACT = 2.5


@single_threaded_blas()
def hunting_cycle(scene: Scene, *, orders: float = ORDERS, threads: int = 1) -> xr.Dataset:
    """Static transmission error and mesh stiffness over all mesh cycles of ``scene`` until the same teeth meet again.

    Parameters
    ----------
    scene
        A scene with effects that differ from tooth to tooth: pitch_errors, waviness.
    orders
        Highest mesh order of the spectrum.
    threads
        Threads of the solver.

    Returns
    -------
    Dataset with ``transmission_error`` and ``mesh_stiffness`` (cycle, position), and the amplitudes of their orders
    (mesh_order): all multiples of the frequency at which the same teeth meet, also as orders of either shaft. With
    x(t) = c_0 + Σ Re(2 c_ν e^{2πiνt}) the amplitude is 2|c_ν|, t in mesh periods.

    Raises
    ------
    InputError
        If no effect differs from tooth to tooth, shafts bear the gears, there are more than 100 000 mesh cycles, or
        none of the ``orders`` is known.
    """
    import xarray as xr

    check_scene(scene)
    start = time.perf_counter()
    cycle = _all_cycles(scene, orders, threads)
    curves = {"transmission_error": cycle.transmission_error, "mesh_stiffness": cycle.mesh_stiffness}
    count = len(cycle.transmission_error)
    order = np.arange(1, _known_orders(cycle.phases, count, orders) + 1) / count
    amplitudes = {
        f"{name}_order_amplitude": (("mesh_order",), 2 * np.abs(order_coefficients(cycle.phases, values, len(order))))
        for name, values in curves.items()
    }
    z_1, z_2 = (abs(gear.teeth) for gear in scene.pair.gears)
    coords = {name: ("position", values) for name, values in cycle.phases.coordinates.items()}
    coords |= {"cycle": ("cycle", np.arange(count)), "mesh_order": ("mesh_order", order)}
    coords |= {"pinion_order": ("mesh_order", order * z_1), "wheel_order": ("mesh_order", order * z_2)}
    variables = {name: (("cycle", "position"), values) for name, values in curves.items()} | amplitudes
    attrs = provenance(scene, wall_time=time.perf_counter() - start)
    return keeping(xr.Dataset(described(variables), coords=described(coords), attrs=attrs), scene)


def _known_orders(phases: Phases, cycles: int, orders: float) -> int:
    """Number of multiples of 1/``cycles`` up to ``orders``; with uniform phases those below half their number."""
    if not orders * cycles + 1e-9 >= 1:
        raise InputError("orders", orders, f"must be at least {1 / cycles:.3g}: {cycles} mesh cycles until all repeats")
    known = math.floor(orders * cycles + 1e-9)
    if phases.size is None:
        known = min(known, (cycles * len(phases.phase) - 1) // 2)
        if not known:
            raise InputError("resolution.positions", len(phases.phase), "must be 3 or more: they give no order at all")
    return known


def _all_cycles(scene: Scene, orders: float, threads: int) -> MeshCycle:
    """δ and k of all mesh cycles, (cycle, position)."""
    if scene.has_shafts:
        raise InputError("system.shafts", "given", "hunting cycles are of gears without shafts")
    count = check_cycles(scene.pair)
    phase, weight = mesh_phases(scene)
    turning = unlike(scene)
    if not turning:
        raise InputError("effects", "all teeth are alike", "must have pitch_errors or waviness")
    require_cycles_memory(scene, turning, len(phase), count, orders)
    lines = scene_lines(scene, phase)
    modes, amounts = turning_gaps(turning, lines, count)
    batch = prepare(assemble(scene, lines, tuple(e for e in scene.flank_effects if e not in turning)), modes)
    phases = Phases(phase=phase, weight=weight, size=scene.resolution.panel_size)
    return solve_cycles(scene, phases, batch, amounts, threads)


def hunting_memory(scene: Scene, positions: int, cycles: int, orders: float, modes: int) -> float:
    """Peak memory [bytes] of mesh cycles whose gaps are sums of ``modes``, and of their orders up to a mesh order."""
    # uniform phases give no orders from half of their number on
    highest = orders if scene.resolution.positions is None else min(orders, positions / 2)
    return cycles_memory(positions, cycles, highest, modes) + OF_CONTACT * contact_memory(scene, positions)


def require_cycles_memory(
    scene: Scene, effects: Sequence[GapEffect], positions: int, cycles: int, orders: float
) -> None:
    """Refuse mesh cycles, that differ by ``effects``, which need more memory than there may be.

    Raises
    ------
    MemoryBudgetError
        Naming numbers of positions or orders that would fit.
    """
    modes = turning_gaps(effects, scene_lines(scene, np.zeros(1)), 1)[1].shape[-1]
    need, limit = hunting_memory(scene, positions, cycles, orders, modes), room()
    each = hunting_memory(scene, positions + 1, cycles, orders, modes) - need
    fewer = int((limit - need) / each + positions)
    lower = orders - (need - limit) / (order_memory() * cycles)
    instead = [f"{fewer} positions"] * (fewer > 0) + [f"{math.floor(10 * lower) / 10:g} orders"] * (lower >= 0.1)
    value = f"{cycles} mesh cycles × {positions} positions, {orders:g} orders of the mesh"
    require(need, "hunting", value, f"{' or '.join(instead) or 'nothing'} would fit")


def check_cycles(pair: Pair) -> int:
    """Mesh cycles until the same teeth meet again; ``InputError`` if there are too many."""
    count = math.lcm(*(gear.teeth for gear in pair.gears))
    if count > MOST_CYCLES:
        allowed = f"{count} mesh cycles until the same teeth meet: at most {MOST_CYCLES}"
        raise InputError("pair.wheel.teeth", pair.wheel.teeth, allowed)
    return count


def unlike(scene: Scene) -> tuple[GapEffect, ...]:
    """Effects of the loaded flank whose gap is another in each mesh cycle."""
    lines, one = scene_lines(scene, np.zeros(1)), np.zeros(1, dtype=int)
    gaps = (effect for effect in scene.flank_effects if isinstance(effect, GapEffect))
    return tuple(effect for effect in gaps if effect.turning(lines, one) is not None)


def turning_gaps(effects: Sequence[GapEffect], lines: ContactLines, count: int) -> tuple[GapModes, NDArray]:
    """Gaps of the first ``count`` mesh cycles, and how much of each mode they have, (cycle, mode)."""

    def parts(each: ContactLines) -> list[Turning]:
        found = (effect.turning(each, np.arange(count)) for effect in effects)
        return [part for part in found if part is not None]

    amounts = np.concatenate([part.amounts for part in parts(lines)], axis=-1)
    modes = GapModes.on(
        lines, lambda each: np.concatenate([part.modes for part in parts(each)], axis=-1), amounts.std(axis=0)
    )
    return modes, amounts


def solve_cycles(scene: Scene, phases: Phases, batch: Batch, amounts: NDArray, threads: int) -> MeshCycle:
    """δ and k of mesh cycles with the gaps ``amounts`` (cycle, m), (cycle, position)."""
    parts = list(on_threads(partial(solve_one_chunk, batch), chunks(amounts), threads))
    approach, stiffness = (
        np.concatenate([getattr(part, name) for part in parts], axis=1).T[: len(amounts)]
        for name in ("approach", "stiffness")
    )
    return MeshCycle.of(scene, phases, approach, stiffness)


def order_coefficients(phases: Phases, values: NDArray, count: int) -> NDArray:
    """c_ν (F8) of the orders ν = 1/N … count/N of values (cycle, position) over N mesh cycles, (order,).

    c_{q/N} = 1/N Σ_n e^{−2πi q n/N} ∫₀¹ x_n(τ) e^{−2πi (q/N) τ} dτ: a Fourier transform over the cycles for each mesh
    phase, which repeats itself after N orders, and one over the phase. Of uniform phases all cycles are one equidistant
    series: orders from half of its points on mean nothing.
    """
    N, q = len(values), np.arange(1, count + 1)
    by_phase, parts = np.fft.fft(values, axis=0) / N, -(-count // ORDERS_AT_ONCE)
    found = [np.einsum("qp,qp->q", _waves(phases, part / N), by_phase[part % N]) for part in np.array_split(q, parts)]
    return np.concatenate(found)


def _waves(phases: Phases, order: NDArray) -> NDArray:
    """Values at the phases of a mesh cycle → ∫₀¹ x(τ) e^{−2πiντ} dτ, (order, position)."""
    if phases.size is None:
        return np.exp(-2j * np.pi * np.outer(order, phases.phase)) / len(phases.phase)
    return fourier_rows(phases, order)


def side_bands(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Amplitudes of the transmission error over mesh orders: those of the mesh, of either shaft, and of neither."""
    from gearbench.plotting import BLUE, GREEN, GREY, ORANGE

    order = dataset["mesh_order"].values
    amplitude = dataset["transmission_error_order_amplitude"].values
    whole = {
        name: np.isclose(dataset[name], np.round(dataset[name]), rtol=0, atol=1e-6)
        for name in ("mesh_order", "pinion_order", "wheel_order")
    }
    mesh, pinion, wheel = whole.values()
    floor = 10.0**-DECADES * np.nanmax(amplitude)
    for these, colour, label in (
        (~(mesh | pinion | wheel), GREY, "both gears"),
        (wheel & ~mesh, GREEN, "orders of the wheel"),
        (pinion & ~mesh, ORANGE, "orders of the pinion"),
        (mesh, BLUE, "mesh orders"),
    ):
        shown = these & (amplitude > floor)
        if shown.any():
            axes.vlines(order[shown], floor, amplitude[shown], color=colour, lw=2.0 if label == "mesh orders" else 1.0)
            axes.plot([], [], color=colour, label=label)
    axes.set(xlabel="mesh order", ylabel="amplitude of δ [µm]", yscale="log", xlim=(0, order[-1] * 1.02))
    axes.set_ylim(floor, 2 * np.nanmax(amplitude))
    return axes


def draw_side_bands(dataset: xr.Dataset, folder: Path) -> Path:
    """Write the figure of the side bands of a hunting cycle."""
    from gearbench.plotting import heading, legend_below, new_figure, write_figure

    figure, ((axes,),) = new_figure(1, 1, (9.0, 4.8))
    side_bands(dataset, axes)
    axes.set_title(f"{heading(dataset)}: {dataset.sizes['cycle']} mesh cycles until the same teeth meet again")
    legend_below(figure, axes, 4)
    return write_figure(figure, folder / "side_bands.png")
