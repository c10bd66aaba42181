"""All periodic responses that can be reached over a range of speeds, and those met as the speed rises and falls."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.dynamics.analysis import GROWTH, spans
from gearbench.dynamics.balance import real, solve
from gearbench.dynamics.continuation import NEWTON, Curve, at_fixed, follow
from gearbench.dynamics.oscillator import Oscillator

#: First and longest step along a curve, in units of speed range and mean deflection.
FIRST, LONGEST = 2e-3, 0.05
#: Largest deflection that curves are followed to, over the mean one, beside the backlash.
LARGEST = 20.0
#: Distance below which two solutions at a speed are one.
SAME = 1e-6


@dataclass(frozen=True, kw_only=True)
class Branches:
    """Solutions at the speeds asked for.

    Parameters
    ----------
    solutions
        (solution, n).
    speed
        Number of the speed of each (solution,).
    multiplier
        Largest Floquet multiplier of each (solution,).
    curve, arc
        Number of the curve on which each lies, and where: points of the curve from its start (solution,).
    curves
        All of them.
    """

    solutions: NDArray
    speed: NDArray
    multiplier: NDArray
    curve: NDArray
    arc: NDArray
    curves: tuple[Curve, ...] = ()

    def at(self, speed: int) -> NDArray:
        """Numbers of the solutions at a speed."""
        return np.flatnonzero(self.speed == speed)

    def stable_at(self, speed: int) -> NDArray:
        """Numbers of the stable ones."""
        return np.flatnonzero((self.speed == speed) & (self.multiplier <= 1 + GROWTH))

    def joins(self, one: int, other: int) -> bool:
        """Whether a curve leads from one solution to another without a fold."""
        if self.curve[one] != self.curve[other]:
            return False
        first, last = sorted((self.arc[one], self.arc[other]))
        between = self.curves[self.curve[one]].parameter[int(np.floor(first)) + 1 : int(np.ceil(last))]
        way = np.diff(between)
        return bool((way > 0).all() or (way < 0).all())


def branches(oscillator: Oscillator, speeds: NDArray) -> Branches:
    """Follow curves through the linear responses at the lowest and highest speed, then at those still without any."""
    linear = linear_responses(oscillator, speeds)
    low, high = oscillator.speeds
    wanted = (speeds - low) / (high - low)
    none = np.empty(0, dtype=int)
    found = Branches(
        solutions=np.empty((0, linear.shape[1])), speed=none, multiplier=np.empty(0), curve=none, arc=np.empty(0)
    )
    ends = [int(np.argmin(speeds)), int(np.argmax(speeds))]
    largest = LARGEST + oscillator.curve.backlash / oscillator.unit
    for k in (*ends, *np.argsort(speeds)):
        if len(found.stable_at(k)) and k not in ends:
            continue
        start = at_fixed(oscillator.system, linear[k], float(wanted[k]), NEWTON)
        if start is None or _is_known(found, k, start):
            continue
        for way in (-1, 1):
            if 0 <= wanted[k] + 1e-9 * way <= 1:
                curve = follow(oscillator.system, start, float(wanted[k]), way, FIRST, LONGEST, largest)
                found = _joined(oscillator, found, curve, wanted)
    return found


def linear_responses(oscillator: Oscillator, speeds: NDArray) -> NDArray:
    """Unknowns (speed, n) of the response as if contact were kept: where curves are looked for."""
    model, group = oscillator.model, oscillator.group
    h = model.receptances(group, speeds, oscillator.harmonics)
    mean = model.stiffness[np.ix_(group.meshes, group.meshes)]
    x, _ = solve(model.excitation(group, oscillator.harmonics), h, mean)
    return np.array([real(one) for one in x[:, 0]]) / oscillator.unit


def _is_known(found: Branches, speed: int, z: NDArray) -> bool:
    near = np.abs(found.solutions[found.at(speed)] - z).max(axis=1, initial=0.0)
    return bool((near < SAME * max(1.0, np.abs(z).max())).any())


def _joined(oscillator: Oscillator, found: Branches, curve: Curve, wanted: NDArray) -> Branches:
    """``found`` with what a curve holds at the speeds wanted, each solution once."""
    known = len(found.speed)
    found = replace(found, curves=(*found.curves, curve))
    before, after = curve.parameter[:-1], curve.parameter[1:]
    for k, value in enumerate(wanted):
        for i in np.flatnonzero((np.minimum(before, after) <= value) & (value <= np.maximum(before, after))):
            share = (value - before[i]) / (after[i] - before[i]) if after[i] != before[i] else 0.0
            guess = (1 - share) * curve.z[i] + share * curve.z[i + 1]
            point = at_fixed(oscillator.system, guess, float(value), NEWTON)
            if point is not None and not _is_known(found, k, point):
                found = replace(
                    found,
                    solutions=np.vstack([found.solutions, point]),
                    speed=np.append(found.speed, k),
                    curve=np.append(found.curve, len(found.curves) - 1),
                    arc=np.append(found.arc, i + share),
                )
    if len(found.speed) == known:
        return found
    size = oscillator.multiplier(found.solutions[known:], wanted[found.speed[known:]])
    return replace(found, multiplier=np.append(found.multiplier, size))


def sweeps(found: Branches, speeds: NDArray) -> NDArray:
    """Number of the solution (2, speed) met as the speed rises and as it falls, −1 where none is stable.

    Each is the stable solution to which the curve leads from the one before without a fold, else the nearest. The first
    is the least of those at its speed.
    """
    met = np.full((2, len(speeds)), -1)
    order = np.argsort(speeds, kind="stable")
    for sweep, way in enumerate((order, order[::-1])):
        last = None
        for k in way:
            stable = found.stable_at(k)
            if not len(stable):
                continue
            if last is None:
                distance = np.linalg.norm(found.solutions[stable][:, 1:], axis=1)
            else:
                distance = np.linalg.norm(found.solutions[stable] - found.solutions[last], axis=1)
                joined = np.array([found.joins(last, one) for one in stable])
                distance = np.where(joined, -1.0, distance)
            last = met[sweep, k] = stable[int(np.argmin(distance))]
    return met


def remarks(oscillator: Oscillator, found: Branches, met: NDArray, speeds: NDArray) -> list[str]:
    """Notes for the reader of the sweeps, one line each."""
    lines = []
    lost = met[0] < 0
    if lost.any():
        lines.append(f"no stable response with the mesh's period found at {spans(speeds, lost)} 1/min")
    if (met[0] != met[1]).any():
        lines.append(f"two stable responses, by the way the speed changes, at {spans(speeds, met[0] != met[1])} 1/min")
    for ends, text in (
        ("size", f"is followed to {LARGEST:g} × the mean deflection, not beyond"),
        ("lost", "could not be followed further"),
    ):
        at = [float(oscillator.speed(curve.parameter[-1])) for curve in found.curves if curve.ends == ends]
        if at:
            where = ", ".join(f"{speed:.5g}" for speed in sorted(at))
            lines.append(f"a curve of responses {text}, at {where} 1/min")
    if oscillator.curve.backlash <= 0:
        lines.append("no backlash: back flanks touch as soon as drive flanks part")
    return lines
