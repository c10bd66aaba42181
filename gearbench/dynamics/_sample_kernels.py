"""Compiled harmonic balance of many error samples, ``LANES`` of them side by side; ``sample_balance`` explains it."""

from __future__ import annotations

import numpy as np

from gearbench.compiled import FUSED, entry, part

#: Number of samples solved side by side, few enough for the processor's cache.
LANES = 64
#: Smallest divisor [N²], the square of a norm, so that a zero vector gives no NaN.
SMALLEST_DIVISOR = np.float32(1e-37)


@part(FUSED)
def _product(a, b, out):
    """Scalar products of a and b (unknown, lane)."""
    for lane in range(LANES):
        out[lane] = 0.0
    for u in range(len(a)):
        for lane in range(LANES):
            out[lane] += a[u, lane] * b[u, lane]


@part(FUSED)
def _subtract(factor, b, a):
    """a ← a − factor · b, with one factor for each lane."""
    for u in range(len(a)):
        for lane in range(LANES):
            a[u, lane] -= factor[lane] * b[u, lane]


@part(FUSED)
def _apply(motion, there, back, stiffness, e, moved, over_time, out):
    """out = e + (V_s − V_0) G e; ``moved`` (unknown, lane) and ``over_time`` (2, row, time, lane) are scratch."""
    rows, orders = len(stiffness), there.shape[1]
    x, f = over_time[0], over_time[1]
    np.dot(motion, e, moved)
    for i in range(rows):
        np.dot(there, moved[i * orders : (i + 1) * orders], x[i])
    f[:] = 0.0
    for i in range(rows):
        for j in range(rows):
            for t in range(f.shape[1]):
                for lane in range(LANES):
                    f[i, t, lane] += stiffness[i, j, t, lane] * x[j, t, lane]
        np.dot(back, f[i], out[i * orders : (i + 1) * orders])
    for u in range(len(e)):
        for lane in range(LANES):
            out[u, lane] += e[u, lane]


@entry(FUSED)
def balance_samples(motion, force_orders, there, back, deviation, blocked, settled, steps, forces):
    """Fill ``forces``, the orders of the mesh forces (speed, order, sample): ``force_orders`` · e.

    e solves e + (V_s − V_0) G e = b. G is ``motion`` (speed, unknown, unknown), V_s − V_0 over time is ``deviation``
    (row, row, time, sample), b is ``blocked`` (unknown, sample). The matrix ``there`` leads from the orders of a row to
    its values over time, ``back`` from these to the orders. Generalised conjugate residuals improve e of a sample to
    a residual of ``settled`` · |b|, in at most ``steps`` steps.
    """
    rows, _, times, samples = deviation.shape
    unknowns, f32 = len(blocked), np.float32
    stiffness, b = np.zeros((rows, rows, times, LANES), f32), np.zeros((unknowns, LANES), f32)
    over_time, orders = np.empty((2, rows, times, LANES), f32), np.empty((force_orders.shape[1], LANES), f32)
    e, r, moved = np.empty_like(b), np.empty_like(b), np.empty_like(b)
    directions, images = np.empty((steps, unknowns, LANES), f32), np.empty((steps, unknowns, LANES), f32)
    sizes, allowed = np.empty((steps, LANES), f32), np.empty(LANES, f32)
    left, factor = np.empty(LANES, f32), np.empty(LANES, f32)
    for first in range(0, samples, LANES):
        count = min(LANES, samples - first)
        # lanes without a sample keep the numbers of the samples before
        stiffness[..., :count], b[:, :count] = deviation[..., first : first + count], blocked[:, first : first + count]
        _product(b, b, allowed)
        for lane in range(LANES):
            allowed[lane] *= settled**2
        for s in range(len(motion)):
            e[:] = b
            _apply(motion[s], there, back, stiffness, e, moved, over_time, r)
            r[:] = b - r
            for step in range(steps):
                _product(r, r, left)
                if (left <= allowed).all():
                    break
                direction, image, size = directions[step], images[step], sizes[step]
                direction[:] = r
                _apply(motion[s], there, back, stiffness, r, moved, over_time, image)
                for k in range(step):
                    _product(images[k], image, factor)
                    for lane in range(LANES):
                        factor[lane] /= sizes[k, lane]
                    _subtract(factor, directions[k], direction)
                    _subtract(factor, images[k], image)
                _product(image, image, size)
                _product(image, r, factor)
                for lane in range(LANES):
                    size[lane] = max(size[lane], SMALLEST_DIVISOR)
                    # a settled sample stays as it is, so that it does not depend on the others
                    factor[lane] *= (left[lane] > allowed[lane]) / size[lane]
                _subtract(factor, image, r)
                _subtract(-factor, direction, e)
            np.dot(force_orders[s], e, orders)
            forces[s, :, first : first + count] = orders[:, :count]
