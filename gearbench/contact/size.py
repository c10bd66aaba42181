"""Memory that a contact problem needs, estimated before it is assembled."""

from __future__ import annotations

import math
from collections.abc import Iterable

from gearbench.budget import SMALL, position_memory, require, result_memory, room
from gearbench.contact.smooth import join_tooth_and_body
from gearbench.effects.base import ComplianceEffect, Dense, LowRank
from gearbench.geometry.action import contact_lines, pair_indices
from gearbench.scene import Scene

#: Upper bound of the number of columns of Ψ; if the memory is small with it, the columns are not counted.
MOST_COLUMNS = 1500


def contact_memory(scene: Scene, positions: int) -> float:
    """Peak memory [bytes] of the contact problem of ``scene`` at a number of mesh phases, including the results."""
    columns, coupled = _columns(scene)
    return positions * position_memory(pairs_of_teeth(scene), scene.resolution.segments, columns, coupled=coupled)


def require_contact_memory(scene: Scene, positions: int) -> None:
    """Refuse a resolution that needs more memory than the budget.

    Raises
    ------
    MemoryBudgetError
        With numbers of segments or positions that would fit.
    """
    pairs, segments = pairs_of_teeth(scene), scene.resolution.segments
    if positions * position_memory(pairs, segments, MOST_COLUMNS, coupled=True) <= SMALL:
        return
    columns, coupled = _columns(scene)
    need = positions * position_memory(pairs, segments, columns, coupled=coupled)
    limit = room()
    fewer = int(limit / position_memory(pairs, segments, columns, coupled=coupled))
    limit /= positions
    fits = [n for n in _round_numbers(segments) if position_memory(pairs, n, columns, coupled=coupled) <= limit]
    instead = [f"segments = {fits[0]}"] if fits else []
    instead += [f"{_round_down(fewer)} positions"] if fewer else []
    value = f"{positions} positions × {pairs} pairs × {segments} segments"
    require(need, "resolution", value, f"{' or '.join(instead)} would fit" if instead else "nothing would fit")


def kept_memory(scene: Scene, positions: int) -> float:
    """Memory [bytes] that a sweep keeps for the results of ``scene`` at a number of mesh phases."""
    return positions * result_memory(pairs_of_teeth(scene) * scene.resolution.segments)


def pairs_of_teeth(scene: Scene) -> int:
    """Maximum number of tooth pairs whose contact lines are computed."""
    more = 2 if scene.effect("off_line_contact") else 0
    return len(pair_indices(scene.pair)) + more


def _columns(scene: Scene) -> tuple[int, bool]:
    """Number of columns of all Ψ, and whether full matrices are needed (coupled tooth pairs, or no contact law)."""
    lines = contact_lines(scene.pair, [0.5], 1)
    acting = [effect for effect in scene.acting_effects if isinstance(effect, ComplianceEffect)]
    by_name = {effect.name: effect for effect in scene.acting_effects}
    columns, coupled, law, ready = 0, False, False, acting
    fe_tooth = None
    if "tooth_bending" in by_name:
        from gearbench.effects.tooth_bending import tooth_bending

        fe_tooth = tooth_bending(scene.effects_by_name, "finite_elements")
    if fe_tooth is not None and fe_tooth.missing_levels(scene.pair, scene.effects_by_name):
        # not computed yet, and too expensive to compute only to count columns: the number is an estimate
        columns, coupled = MOST_COLUMNS // 10, "gear_body" in by_name
        ready = [effect for effect in acting if effect is not fe_tooth]
    flanks = {effect: part for effect in ready if (part := effect.flank_compliances(lines, by_name)) is not None}
    joined = join_tooth_and_body(list(flanks.values()))
    if len(joined) < len(flanks):
        # teeth and bodies are summed a few positions at a time: no columns are kept
        coupled = coupled or any(part.coupled for part in flanks.values())
        ready = [effect for effect in ready if effect not in flanks]
    for effect in ready:
        part = effect.compliance(lines, by_name)
        law = law or not isinstance(part, (LowRank, Dense))
        columns += part.factor.shape[-1] if isinstance(part, LowRank) else 0
        coupled = coupled or isinstance(part, Dense) or (isinstance(part, LowRank) and part.coupled)
    return columns, coupled or not law


def _round_numbers(most: int) -> Iterable[int]:
    """Numbers of segments below ``most``, in descending order."""
    return sorted({round(most / 2 ** (i / 2)) for i in range(1, 24)} - {0, most}, reverse=True)


def _round_down(number: int) -> int:
    """Round down to two digits."""
    step = 10 ** max(int(math.log10(number)) - 1, 0)
    return number // step * step
