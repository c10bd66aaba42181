"""Deflection of the teeth themselves in extended precision: plates or solids, as a scene asks for."""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace as Namespace

import mpmath as mp

from gearbench.compliance.local import waves_across
from gearbench.compliance.solid_tooth import RANK_TOLERANCE
from gearbench.effects.teeth import solid_order
from gearbench.geometry.pair import Pair
from gearbench.scene import Scene
from tests.stability.extended.balls import Matrix, ball, number, working
from tests.stability.extended.geometry import geometry
from tests.stability.extended.local import compression
from tests.stability.extended.numbers import Number
from tests.stability.extended.plate import plate_factor
from tests.stability.extended.solid import Tooth


def tooth_factor(scene: Scene, s: Namespace) -> list[Number]:
    """ψ of both teeth at a segment [√(mm/N)]."""
    bending = scene.effect("tooth_bending")
    if bending is None:
        return []
    if bending.fillet or bending.load != "full":
        raise NotImplementedError("plate without fillet only")
    G, psi = geometry(scene.pair), []
    for index, u in enumerate((s.u, G.T - s.u)):
        g = G.gears[index]
        R = mp.hypot(g.r_b, u)
        if bending.model == "solid":
            psi += solid_factor(scene.pair, index, bending.order, R, s.y)
        else:
            psi += plate_factor(scene.pair, index, bending.order, (R - g.r_f) / (g.r_a - g.r_f), s.y / G.b)
    return psi


def solid_tooth(pair: Pair, index: int, order: tuple[int, int, int]) -> Tooth:
    """Solid tooth of pinion or wheel; inside ``working``."""
    G, material = geometry(pair), pair.material
    return Tooth(G.gears[index], ball(G.b), ball(material.E), ball(material.nu), order)


@lru_cache(maxsize=64)
def flank_compliance(pair: Pair, index: int, order: tuple[int, int, int], p: int, q: int) -> Matrix:
    """Compliance between the polynomials of the flank, root held."""
    with working():
        return solid_tooth(pair, index, order).compliance(p, q)


@lru_cache(maxsize=64)
def solid_root(pair: Pair, index: int, order: tuple[int, int, int] | None) -> tuple[int, int, list[list[Number]]]:
    """Numbers of polynomials in R and y, and B with B Bᵀ the compliance between them less what the law counts."""
    gear = pair.gears[index]
    order = order or solid_order(gear)
    p, q = min(5, order[1]), min(order[2], waves_across(gear))
    with working():
        C = flank_compliance(pair, index, order, p, q)
        local = compression(geometry(pair).gears[index], pair.face_width, pair.material.E, pair.material.nu, p, q)
        rows = [[number(C[i, j]) - mp.mpf(local[i, j]) for j in range(p * q)] for i in range(p * q)]
        values, vectors = mp.eigsy(mp.matrix(rows))
        keep = [c for c in range(p * q) if values[c] > RANK_TOLERANCE * max(values)]
        return p, q, [[vectors[i, c] * mp.sqrt(values[c]) for c in keep] for i in range(p * q)]


def solid_factor(pair: Pair, index: int, order: tuple[int, int, int] | None, R: Number, y: Number) -> list[Number]:
    """ψ of one tooth [√(mm/N)]; on the driven wheel y is counted from the other end."""
    G = geometry(pair)
    g = G.gears[index]
    p, q, B = solid_root(pair, index, order)
    along = functions(p, min(max((R - g.form) / (g.r_a - g.form), mp.mpf(0)), mp.mpf(1)), g.r_a - g.form)
    across = functions(q, (G.b - y if index else y) / G.b, G.b)
    shapes = [a * c for a in along for c in across]
    return [mp.fdot(zip(shapes, column, strict=True)) for column in zip(*B, strict=True)]


def functions(count: int, at: Number, span: Number) -> list[Number]:
    """Legendre functions orthonormal on an interval of length ``span``, at this fraction of it."""
    return [mp.sqrt((2 * k + 1) / span) * mp.legendre(k, 2 * at - 1) for k in range(count)]
