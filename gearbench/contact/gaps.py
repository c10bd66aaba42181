"""Gaps between the flanks: their sum over the effects on contact lines, their kinks, and whether they vary at all."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.phases import mirrored_phases
from gearbench.effects.base import Effect, GapEffect
from gearbench.geometry.action import ContactLines, contact_lines
from gearbench.geometry.pair import Pair
from gearbench.geometry.separation import Separation, separation
from gearbench.scene import Scene

#: Variation up to which a gap is treated as constant [mm].
LEAST_VARIATION = 1e-10
#: Numbers of mesh phases, and of segments on a line, at which ``variation`` samples the gap.
TRIAL_PHASES, TRIAL_SEGMENTS = 8, 12


def flank_separation(scene: Scene) -> Separation | None:
    """Separation of the modified profiles for contact off the line of action; None for contact on the line."""
    return None if scene.effect("off_line_contact") is None else profile_separation(scene)


def profile_separation(scene: Scene) -> Separation:
    """Separation of the unloaded profiles over u, modifications included (``geometry.separation``)."""
    gaps = [effect for effect in scene.flank_effects if isinstance(effect, GapEffect)]
    return separation(scene.pair, tuple(m for effect in gaps for m in effect.modifications(scene.pair)))


def gap_kinks(scene: Scene) -> tuple[list[float], list[float]]:
    """Positions u along the path of contact and y over the face [mm] at which a gap or a result has a kink.

    Off the line of action the kinks of the profile modifications are those of the separation.
    """
    gaps, flanks = gap_effects(scene), flank_separation(scene)
    not_in_flanks = [gap for gap in gaps if flanks is None or not gap.modifications(scene.pair)]
    profile = [] if flanks is None else [float(u) for u in flanks.kinks]
    if scene.operation is not None:
        profile.append(scene.pair.meshing.pitch_point)  # sliding changes its sign there, and friction has a kink
    b = scene.pair.meshing.face_width
    face = [y for gap in gaps for y in gap.face_kinks(scene.pair) if 0 <= y <= b]
    if scene.load.coast:  # lines of coast flanks are those of the mirror image (G10 of docs/theory.md)
        face = [b - y for y in face]
    return profile + [u for gap in not_in_flanks for u in gap.kinks(scene.pair)], face


def gap_effects(scene: Scene) -> tuple[GapEffect, ...]:
    """Acting effects of ``scene`` that add a gap: those of the flanks, and the motion of the shafts."""
    return tuple(effect for effect in scene.acting_effects if isinstance(effect, GapEffect))


def variation(scene: Scene, span: tuple[float, float] | None = None) -> tuple[float, float]:
    """Largest variation of the gap along one contact line, and over all lines [mm].

    ``span`` is the range of u [mm], by default the path of contact.
    """
    kinks, face = map(tuple, gap_kinks(scene))
    return _variation(scene.pair, gap_effects(scene), scene.load.coast, (kinks, face), flank_separation(scene), span)


@lru_cache(maxsize=32)
def _variation(
    pair: Pair,
    effects: tuple[GapEffect, ...],
    coast: bool,
    kinks: tuple[tuple[float, ...], tuple[float, ...]],
    flanks: Separation | None,
    span: tuple[float, float] | None,
) -> tuple[float, float]:
    # with these phases the result stays the same if pinion and wheel are exchanged
    phase = mirrored_phases(pair, TRIAL_PHASES)
    lines = contact_lines(pair, phase, TRIAL_SEGMENTS, *kinks, coast=coast, span=span)
    gap = total_gap(effects, replace(lines, separation=flanks))[lines.active]
    return float(np.ptp(gap, axis=1).max(initial=0.0)), float(np.ptp(gap, axis=None)) if gap.size else 0.0


def conforming(scene: Scene) -> bool:
    """Whether the gap of the flanks is the same everywhere, so that all lines are loaded over their length.

    Never for contact off the line of action: beyond the path of contact the flanks part.
    """
    return flank_separation(scene) is None and variation(scene)[1] <= LEAST_VARIATION


def total_gap(effects: Iterable[Effect], lines: ContactLines) -> NDArray:
    """Sum of the gaps of the ``effects`` (position, pair, segment) [mm], divided by the levers of the segments.

    A lever is the lever arm of the normal force about the pinion's axis, divided by its base radius; 1 on the line of
    action.
    """
    total = np.zeros(lines.shape)
    for effect in effects:
        # off the line of action ``touch`` is set: the separation in ``off_line_contact`` contains these modifications
        if isinstance(effect, GapEffect) and not (lines.touch and effect.modifications(lines.pair)):
            total += effect.gap(lines) / lines.lever
    return total


def gaps_along(effects: Iterable[Effect], lines: ContactLines) -> NDArray:
    """Total gap [mm] at the beginning, middle and end of cells (…, 3), or at segments that are Gauss points (…, 1)."""
    if not lines.cells:
        return total_gap(effects, lines)[..., None]
    return np.stack([total_gap(effects, at) for at in (lines.moved(-1), lines, lines.moved(1))], axis=-1)


def gap_and_variation(gaps: NDArray) -> tuple[NDArray, NDArray]:
    """Gap at the nodes and half its variation over the cells (0 for points), from the result of ``gaps_along``."""
    return gaps[..., gaps.shape[-1] // 2], np.abs(gaps[..., -1] - gaps[..., 0]) / 2
