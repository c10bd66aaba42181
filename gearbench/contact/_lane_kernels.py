"""What compiled solvers of samples side by side begin from, and what they keep from one position to the next.

Arrays end with the lane: one sample a lane, which sees no other.
"""

from __future__ import annotations

from gearbench.compiled import FUSED, part

#: Samples solved side by side.
LANES = 128


@part(FUSED)
def add_combination(start, stop, coefficient, column, rows, out, r):
    """out[r] += Σ_i coefficient[i, column] · rows[i] over start ≤ i < stop, four rows at a time."""
    i = start
    while i + 4 <= stop:
        a, b = coefficient[i, column], coefficient[i + 1, column]
        c, d = coefficient[i + 2, column], coefficient[i + 3, column]
        for j in range(LANES):
            out[r, j] += (a * rows[i, j] + b * rows[i + 1, j]) + (c * rows[i + 2, j] + d * rows[i + 3, j])
        i += 4
    while i < stop:
        a = coefficient[i, column]
        for j in range(LANES):
            out[r, j] += a * rows[i, j]
        i += 1


@part(FUSED)
def begin(start, guess, draws, weights, missed, q):
    """First guess of the unknowns q (n, lanes): start + guess · draws, and by their weights what it missed before.

    missed (2, n, lanes), at the two positions before; then less the first part at this one, and at the one before.
    """
    for r in range(q.shape[0]):
        for j in range(LANES):
            q[r, j] = start[r]
        add_combination(0, draws.shape[0], guess, r, draws, q, r)
        for j in range(LANES):
            more = weights[0] * missed[0, r, j] + weights[1] * missed[1, r, j]
            missed[1, r, j] = missed[0, r, j]
            missed[0, r, j] = -q[r, j]
            q[r, j] += more


@part(FUSED)
def note_missed(unknowns, done, missed):
    """Add the unknowns found (n, lanes) to missed, less their first guess; nothing is known of lanes not done."""
    for i in range(unknowns.shape[0]):
        for j in range(LANES):
            missed[i, j] = missed[i, j] + unknowns[i, j] if done[j] == 1.0 else 0.0


@part(FUSED)
def keep_settled(unknowns, delta, stiffness, done, kept):
    """Unknowns (n, lanes), δ, ∂F/∂δ and whether they are done of all lanes, into kept (n + 3, lanes)."""
    n = unknowns.shape[0]
    for i in range(n):
        for j in range(LANES):
            kept[i, j] = unknowns[i, j]
    for j in range(LANES):
        kept[n, j], kept[n + 1, j], kept[n + 2, j] = delta[j], stiffness[j], done[j]


@part(FUSED)
def restore_settled(unknowns, delta, stiffness, done, kept):
    """Lanes that were done get back from kept what they had: they must not see that others were not."""
    n = unknowns.shape[0]
    for j in range(LANES):
        if kept[n + 2, j] == 1.0:
            delta[j], stiffness[j], done[j] = kept[n, j], kept[n + 1, j], 1.0
            for i in range(n):
                unknowns[i, j] = kept[i, j]
