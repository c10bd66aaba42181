"""Hard contact problems that no scene leads to by itself: given by their compliance and gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.problem import ContactProblem
from tests.stability.catalogue import HELICAL, YANG, scene


@dataclass(frozen=True, kw_only=True)
class HardProblem:
    """A named contact problem, why it is hard, the digits asserted against extended precision and the most steps.

    Steps are Newton's; those of the dense active set, where rounding is corrected, come on top.
    """

    name: str
    why: str
    build: Callable[[], ContactProblem]
    digits: float = 13.0
    steps: int = 30


def ordinary() -> ContactProblem:
    """One position of a helical pair with the linear law."""
    s = scene(HELICAL, law=YANG)
    return assemble(s, scene_lines(s, np.array([0.31])))


def duplicated() -> ContactProblem:
    """Every segment twice at the same place, each with twice the compliance of its law."""
    p = ordinary()
    twice = {n: np.repeat(getattr(p, n), 2, axis=1) for n in ("gap", "active", "factor", "a", "h", "sigma")}
    return replace(
        p, **{**twice, "a": 2 * twice["a"]}, block=np.repeat(p.block, 2), shape=(1, p.shape[1], 2 * p.shape[2])
    )


def stiff_law(factor: float) -> ContactProblem:
    """A law ``factor`` times stiffer: what is left of H is the plate's rank of six per pair."""
    p = ordinary()
    return replace(p, a=p.a * factor)


def no_law(spread: float) -> ContactProblem:
    """No law at all, H = V diag(1 … 1/spread) Vᵀ of 24 segments: condition number ``spread``."""
    rng = np.random.default_rng(5)
    n = 24
    V = np.linalg.qr(rng.normal(size=(n, n)))[0]
    factor = V * np.sqrt(np.geomspace(1.0, 1.0 / spread, n))
    zero = np.zeros((1, n))
    return ContactProblem(
        gap=0.02 * rng.random((1, n)), a=zero, h=zero, sigma=zero, active=np.ones((1, n), bool), factor=factor[None],
        block=np.zeros(n, np.int64), blocks=1, force=1.0, length_scale=1.0, shape=(1, 1, n),
    )  # fmt: skip


def tied(gap: float) -> ContactProblem:
    """Gaps such that some segments touch exactly without load: P = 0 and gap = 0 together."""
    n = 12
    e = np.where(np.arange(n) % 3 == 0, gap, 0.0)
    # the eight segments at zero share the load alone, δ = a/8: with gap = 1/8 the other four just touch
    return ContactProblem(
        gap=e[None], a=np.ones((1, n)), h=np.zeros((1, n)), sigma=np.zeros((1, n)), active=np.ones((1, n), bool),
        factor=np.zeros((1, n, 0)),
        block=np.zeros(n, np.int64), blocks=1, force=1.0, length_scale=1.0, shape=(1, 1, n),
    )  # fmt: skip


PROBLEMS: dict[str, HardProblem] = {
    p.name: p
    for p in (
        HardProblem(name="duplicated segments", why="equal rows and columns of H but for the law", build=duplicated),
        *(
            HardProblem(
                name=f"law × {f:.0e}",
                why="H is all but singular: forces that follow from the amplitudes lose what the law is smaller by"
                if f < 1
                else "the plate is a perturbation of the law",
                build=lambda f=f: stiff_law(f),
                digits=d,
                steps=n,
            )
            for f, d, n in ((1e-3, 12, 30), (1e-6, 9.9, 40), (1e-9, 12, 40), (1e6, 13, 30))
        ),
        *(
            HardProblem(
                name=f"no law, condition {c:.0e}",
                why="without a law H alone must determine the loads",
                build=lambda c=c: no_law(c),
                digits=d,
            )
            for c, d in ((1e2, 13), (1e6, 13), (1e10, 13))
        ),
        HardProblem(
            name="segments that just touch",
            why="P = 0 and gap = 0 together: either set is right",
            build=lambda: tied(0.125),
        ),
        HardProblem(
            name="segments that all but touch",
            why="a gap of one unit in the last place decides the set",
            build=lambda: tied(float(np.nextafter(0.125, 0))),
        ),
    )
}
