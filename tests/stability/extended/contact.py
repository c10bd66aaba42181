"""The contact problem in extended precision: plain Newton steps instead of a line search."""

from __future__ import annotations

from dataclasses import dataclass

import mpmath as mp

from tests.stability.extended.numbers import DIGITS, Number, cholesky, forward


@dataclass(frozen=True)
class Answer:
    """Forces [N] of the segments, δ_n [mm] and ∂F_n/∂δ_n [N/mm] of one mesh phase; least gap of a separated segment."""

    force: list[Number]
    approach: Number
    stiffness: Number


def law(s: Number, a: Number, h: Number) -> tuple[Number, Number]:
    """P and dP/ds of P (a − h ln P) = s, continued by its tangent where a/h − ln P < 2."""
    if s <= 0:
        return mp.mpf(0), mp.mpf(0)
    if h == 0:
        return s / a, 1 / a
    edge = mp.exp(a / h - 2)
    if s >= 2 * h * edge:
        return edge + (s - 2 * h * edge) / h, 1 / h
    level = a / h + mp.log(h) - mp.log(s)
    big = level + mp.log(level) + mp.mpf(1) / 2
    for _ in range(60):
        step = (big - mp.log(big) - level) * big / (big - 1)
        big -= step
        if abs(step) < mp.mpf(10) ** (-DIGITS // 2 - 3) * big:
            break
    return s / (h * big), 1 / (h * (big - 1))


def cell_law(s: Number, a: Number, h: Number, sigma: Number) -> tuple[Number, Number]:
    """The same over a cell along which the compression varies by ±soft."""
    if s >= sigma:
        return law(s, a, h)
    if s <= -sigma:
        return mp.mpf(0), mp.mpf(0)
    t, whole = (s + sigma) / (2 * sigma), law(sigma, a, h)[0]
    return whole * t**2, whole * t / sigma


def reduced(block: list[int], psi: list[list[Number]]) -> list[list[Number]]:
    """Another square root of Ψ Ψᵀ where a tooth has more amplitudes than its contact line has segments."""
    members = {k: [i for i, b in enumerate(block) if b == k] for k in set(block)}
    most = max(map(len, members.values()))
    if len(psi[0]) <= most:
        return psi
    small: list[list[Number]] = [[]] * len(psi)
    for mine in members.values():
        gram = mp.matrix(len(mine))
        for a, i in enumerate(mine):
            for c, j in enumerate(mine[: a + 1]):
                gram[a, c] = gram[c, a] = mp.fdot(zip(psi[i], psi[j], strict=True))
        for i, row in zip(mine, cholesky(gram), strict=True):
            small[i] = row + [mp.mpf(0)] * (most - len(row))
    return small


def contact(
    block: list[int],
    psi: list[list[Number]],
    a: list[Number],
    h: list[Number],
    sigma: list[Number],
    e: list[Number],
    start: tuple[list[float], float],
) -> tuple[list[Number], Number, Number]:
    """Forces, δ and ∂F/∂δ for ΣP = 1, by Newton's method on (q, δ) from the forces and δ of ``start``."""
    psi = reduced(block, psi)
    blocks, rank, n = sorted(set(block)), len(psi[0]), len(e)
    q = {k: [mp.fsum(start[0][i] * psi[i][c] for i in range(n) if block[i] == k) for c in range(rank)] for k in blocks}
    delta, residual = mp.mpf(start[1]), mp.inf
    for _ in range(80):
        s = [delta - e[i] - mp.fdot(zip(psi[i], q[block[i]], strict=True)) for i in range(n)]
        pairs = [cell_law(s[i], a[i], h[i], sigma[i]) for i in range(n)]
        total, slope = 1 - mp.fsum(p for p, _ in pairs), mp.fsum(w for _, w in pairs)
        steps = {}
        residual = abs(total)
        for k in blocks:
            mine = [i for i in range(n) if block[i] == k and pairs[i][0] > 0]
            grad = [q[k][c] - mp.fsum(pairs[i][0] * psi[i][c] for i in mine) for c in range(rank)]
            cross = [mp.fsum(pairs[i][1] * psi[i][c] for i in mine) for c in range(rank)]
            hess = mp.eye(rank) if rank else mp.matrix(0)
            for c in range(rank):
                for d in range(c + 1):
                    hess[c, d] = (c == d) + mp.fsum(pairs[i][1] * psi[i][c] * psi[i][d] for i in mine)
            L = cholesky(hess)
            y, x = forward(L, cross), forward(L, grad)
            slope -= mp.fdot(zip(y, y, strict=True))
            total -= mp.fdot(zip(y, x, strict=True))
            steps[k] = (L, y, x)
            residual = max([residual, *map(abs, grad)])
        if residual < mp.mpf(10) ** (8 - DIGITS):
            return [p for p, _ in pairs], delta, slope
        step = total / slope
        for k, (L, y, x) in steps.items():
            right = [yc * step - xc for yc, xc in zip(y, x, strict=True)]
            for c in reversed(range(rank)):  # L⁻ᵀ
                right[c] = (right[c] - mp.fsum(L[d][c] * right[d] for d in range(c + 1, rank))) / L[c][c]
            q[k] = [old + new for old, new in zip(q[k], right, strict=True)]
        delta += step
    raise ArithmeticError(f"extended contact not solved: residual {mp.nstr(residual, 3)}")


def equal_approach(psi: list[list[Number]], e: list[Number], loaded: list[int]) -> Answer:
    """Without a law: the ``loaded`` segments brought to one approach, checked to be the right ones."""
    H = mp.matrix(len(loaded))
    for a, i in enumerate(loaded):
        for c, j in enumerate(loaded):
            H[a, c] = mp.fdot(zip(psi[i], psi[j], strict=True))
    ones, gaps = mp.matrix([1] * len(loaded)), mp.matrix([e[i] for i in loaded])
    x, z = mp.lu_solve(H, ones), mp.lu_solve(H, gaps)
    k = mp.fsum(x)
    delta = (1 + mp.fsum(z)) / k
    force = [mp.mpf(0)] * len(e)
    for a, i in enumerate(loaded):
        force[i] = delta * x[a] - z[a]
    q = [mp.fsum(force[i] * psi[i][c] for i in loaded) for c in range(len(psi[0]))]
    rest = [mp.fdot(zip(p, q, strict=True)) + g - delta for p, g in zip(psi, e, strict=True)]
    if min(force) < 0 or min(rest) < -(mp.mpf(10) ** (8 - DIGITS)):
        raise ArithmeticError("another set of segments carries")
    return Answer(force, delta, k)
