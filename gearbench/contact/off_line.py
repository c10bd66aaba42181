"""How much a solution on the line of action misses: a cheap estimate, without solving again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import profile_separation, total_gap
from gearbench.effects.base import GapEffect
from gearbench.geometry.action import contact_lines
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

#: How far beyond the path of contact the estimate looks [base pitches].
_REACH = 0.3
#: Phases and segments of the estimate.
_PHASES, _SEGMENTS = 96, 9
#: Relative change of the RMS that is worth a line.
_WORTH_SAYING = 0.05


@dataclass(frozen=True, kw_only=True)
class Missed:
    """What contact kept on the line of action misses.

    Parameters
    ----------
    rms_ratio
        RMS of the STE on the line over that with contact where flanks touch.
    share
        Greatest share of the load that is carried outside the path of contact.
    """

    rms_ratio: float
    share: float


def estimate(scene: Scene, mean: float, rms: float) -> Missed:
    """Estimate from separations and the ``mean`` and ``rms`` of the STE [µm] of a solution on the line of action.

    Every line is a bedding of constant stiffness c per unit length under compressions δ − e, as in ISO 6336, such that
    the RMS of the STE on the line is that of the solution; the rest of its mean is the bodies', which move all teeth
    alike and close no gaps. The bedding is solved once more with the gaps of flanks that touch first anywhere.
    """
    pair, meshing = scene.pair, scene.pair.meshing
    room = _REACH * meshing.base_pitch
    phase = (np.arange(_PHASES) + 0.5) / _PHASES
    flanks, span = profile_separation(scene), (meshing.path_start - room, meshing.path_end + room)
    coast = scene.load.coast
    plain = contact_lines(pair, phase, _SEGMENTS, coast=coast)
    wide = contact_lines(pair, phase, _SEGMENTS, coast=coast, separation=flanks, span=span)
    assert wide.touch is not None
    cos_b = math.cos(meshing.beta_b)
    exact = np.minimum(wide.touch.gap, room) * cos_b
    for effect in scene.flank_effects:
        if isinstance(effect, GapEffect) and not effect.modifications(pair):
            exact = exact + effect.gap(wide)
    gaps = [gap.reshape(_PHASES, -1) for gap in (total_gap(scene, plain), exact)]
    weight = [lines.length.reshape(_PHASES, -1) for lines in (plain, wide)]
    mean, rms, load = mean * 1e-3 * cos_b, rms * 1e-3 * cos_b, scene.F_bn
    softest = load / mean / float(weight[0].sum(axis=1).mean())
    c = 2 * softest
    for _ in range(20):
        c = max(softest, c * (float(_approach(gaps[0], weight[0], load / c).std()) / max(rms, 1e-3 * mean)))
    on_line, off_line = (_approach(g, w, load / c) for g, w in zip(gaps, weight, strict=True))
    outside = ((wide.u < meshing.path_start) | (wide.u > meshing.path_end)).reshape(_PHASES, -1)
    carried = c * weight[1] * np.maximum(off_line[:, None] - gaps[1], 0.0)
    share = (carried * outside).sum(axis=1) / load
    return Missed(rms_ratio=float(on_line.std() / off_line.std()), share=float(share.max()))


def advice(scene: Scene, dataset: xr.Dataset) -> str | None:
    """One line where a solution on the line of action misses more than 5 % of the RMS of the STE, by estimate.

    None where the scene has the effect, cannot have it, or the Dataset lacks mean and RMS of the STE.
    """
    names = ("transmission_error_mean", "transmission_error_rms")
    effects = scene.effects_by_name
    if "off_line_contact" in effects or "hertz" not in effects or any(name not in dataset for name in names):
        return None
    mean, rms = (float(dataset[name]) for name in names)
    # gaps without load: the mean need not be a deflection
    if mean <= 0:
        return None
    excess = estimate(scene, mean, rms).rms_ratio - 1
    if not abs(excess) > _WORTH_SAYING:
        return None
    size = f"{100 * abs(excess):.0f} % too {'large' if excess > 0 else 'small'}"
    return f"RMS of STE may be {size}: add [effects.off_line_contact]"


def _approach(gap: NDArray, weight: NDArray, load: float) -> NDArray:
    """δ with Σ w max(0, δ − e) = load, of each row: exact, from the sorted gaps."""
    order = np.argsort(np.where(weight > 0, gap, np.inf), axis=1)
    e, w = (np.take_along_axis(x, order, axis=1) for x in (gap, weight))
    total, moment = np.cumsum(w, axis=1), np.cumsum(w * np.where(w > 0, e, 0.0), axis=1)
    delta = (load + moment) / np.where(total > 0, total, np.inf)
    # the right number of segments is the first at whose δ the next one is still apart
    following = np.concatenate([np.where(w > 0, e, np.inf)[:, 1:], np.full((len(e), 1), np.inf)], axis=1)
    return delta[np.arange(len(e)), np.argmax((delta <= following) & (total > 0), axis=1)]
