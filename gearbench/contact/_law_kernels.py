"""Compiled contact law of all segments of a position at once: loops without branches, which become vector instructions.

The same law as ``gearbench.contact.law``, which the tests hold it to. The level L = a/h − ln P follows from L − ln L =
κ − ln s, κ = a/h + ln h, by a rational approximation and one step of Halley's method, and one of Newton's for the last
digits; logarithms are read off the bits.
"""

from __future__ import annotations

import math

import numpy as np

from gearbench.compiled import FUSED, SUMS, entry, part
from gearbench.contact._logarithm_kernels import LN2, MAGIC, MANTISSA, ONE, level_start, logarithm_parts
from gearbench.contact.law import TANGENT_FROM

#: Rows of the constants of the law of each segment, and of scratch.
CONSTANTS, SCRATCH = 7, 5
#: Compressions below this are as good as this one: its force is.
_LEAST = 1e-40
#: κ − ln s from which L is guessed by its series.
_FAR = 110.0


@part(FUSED)
def split(bits, mantissa, exponent):
    """Mantissa in [1, 2) and exponent of positive doubles, through their bits."""
    for j in range(bits.size):
        mantissa[j] = (bits[j] & MANTISSA) | ONE
        exponent[j] = (bits[j] >> 52) | MAGIC


@part(FUSED)
def first_level(kappa, x, mantissa, exponent, level):
    """First guess of L with L − ln L = κ − ln x, and x ← x / L; the greatest right side."""
    greatest = 0.0
    for j in range(x.size):
        y, bottom, product, inverse = level_start(kappa[j], mantissa[j], exponent[j])
        greatest = max(greatest, y)
        level[j] = product * product * inverse
        x[j] = x[j] * bottom * bottom * inverse
    return greatest


@part()
def far_level(kappa, x, edge, s, level):
    """As ``first_level`` where the right side is beyond what the rational approximation is for."""
    for j in range(x.size):
        compressed = min(s[j], edge[j])
        y = kappa[j] - math.log(compressed)
        if y > _FAR:
            rise = math.log(y)
            level[j] = y + rise + rise / y
            x[j] = compressed / level[j]


@part(FUSED)
def last_level(kappa, mantissa, exponent, level):
    """L to the last digits, from its first guess and the mantissa and exponent of x/L."""
    for j in range(level.size):
        e, f, r = logarithm_parts(mantissa[j], exponent[j])
        L = level[j]
        logarithm = e * LN2 + 2.0 * f * r
        residual = L - kappa[j] + logarithm
        slope = L - 1.0
        change = -residual * slope / (slope * slope - 0.5 * residual)  # Halley's, over L
        # ln(1 + change), of a change of 2e-4 at most
        logarithm -= change * (1.0 - change * (0.5 - change * (1.0 / 3 - change * 0.25)))
        L += L * change
        level[j] = L - (L - kappa[j] + logarithm) * L / (L - 1.0)


@part(SUMS)
def apply_law(s, constants, level, force, weight):
    """Forces, slopes, and ΣP, ΣdP/ds and ∫ΣP ds of segments compressed by s, of known L."""
    a, h, edge, soft, whole, excess = constants[0], constants[1], constants[3], constants[4], constants[5], constants[6]
    total, slope, value = 0.0, 0.0, 0.0
    for j in range(s.size):
        middle = max(s[j] - soft[j], _LEAST)
        x, over = min(middle, edge[j]), max(middle - edge[j], 0.0)
        L, straight = level[j], h[j] == 0.0
        low = x / (a[j] if straight else h[j] * L)
        rise = 1.0 / (a[j] if straight else h[j] if over > 0.0 else h[j] * (L - 1.0))
        beyond = 0.0 if straight else over / h[j]
        energy = 0.5 * x * low if straight else h[j] * low * low * (0.5 * L - 0.25) + over * (low + 0.5 * beyond)
        # of cells of which only the part t is loaded
        t = s[j] / (2.0 * soft[j]) if soft[j] > 0.0 else 1.0
        part, on = t < 1.0, s[j] > 0.0
        p = whole[j] * t * t if part else low + beyond
        w = whole[j] * t / soft[j] if part else rise
        e = 2.0 / 3.0 * soft[j] * whole[j] * t * t * t if part else energy + excess[j]
        force[j] = p if on else 0.0
        weight[j] = w if on else 0.0
        total += p if on else 0.0
        slope += w if on else 0.0
        value += e if on else 0.0
    return total, slope, value


@part(FUSED)
def apply_laws(s, constants, scratch, bits, force, weight):
    """Fill forces and slopes of segments compressed by s; ΣP, ΣdP/ds and ∫ΣP ds.

    ``scratch`` (5, segment) and ``bits``, the same memory as whole numbers.
    """
    n = s.size
    soft, kappa, edge = constants[4], constants[2], constants[3]
    x, mantissa, exponent, level, middle = (
        scratch[0, :n], scratch[1, :n], scratch[2, :n], scratch[3, :n], scratch[4, :n]
    )  # fmt: skip
    for j in range(n):
        middle[j] = max(s[j] - soft[j], _LEAST)
        x[j] = min(middle[j], edge[j])
    split(bits[0, :n], bits[1, :n], bits[2, :n])
    if first_level(kappa, x, mantissa, exponent, level) > _FAR:
        far_level(kappa, x, edge, middle, level)
    split(bits[0, :n], bits[1, :n], bits[2, :n])
    last_level(kappa, mantissa, exponent, level)
    return apply_law(s, constants, level, force, weight)


@part()
def law_constants(a, h, soft, constants, scratch, force, weight):
    """Fill the rows of ``constants`` with what forces follow from; the other arrays are scratch.

    a, h, κ, the compression where the tangent takes over, σ, P_σ, and by what a cell's energy exceeds its middle's.
    """
    last, logarithm, cells = 0.0, 0.0, False
    for j in range(a.size):
        constants[0, j], constants[1, j], constants[4, j] = a[j], h[j], 0.0
        constants[2, j], constants[3, j], constants[5, j], constants[6, j] = 0.0, math.inf, 0.0, 0.0
        if h[j] > 0.0:
            if h[j] != last:  # most are alike
                last, logarithm = h[j], math.log(h[j])
            ratio = a[j] / h[j]
            constants[2, j] = ratio + logarithm
            constants[3, j] = TANGENT_FROM * h[j] * math.exp(min(ratio, 690.0) - TANGENT_FROM)
        cells |= soft[j] > 0.0
    if cells:
        apply_laws(soft, constants, scratch, scratch.view(np.int64), force, weight)
        level, edge = scratch[3], constants[3]
        for j in range(a.size):
            p = force[j]
            constants[4, j], constants[5, j] = soft[j], p
            if h[j] == 0.0:
                constants[6, j] = (2.0 / 3.0 - 0.5) * soft[j] * p
            else:
                over = max(soft[j] - edge[j], 0.0)
                low = p - over / h[j]
                energy = h[j] * low * low * (0.5 * level[j] - 0.25) + over * (low + over / (2.0 * h[j]))
                constants[6, j] = 2.0 / 3.0 * soft[j] * p - energy


@entry()
def law_forces(s, a, h, soft):
    """Forces of segments compressed by s."""
    n = s.size
    constants, scratch = np.empty((CONSTANTS, n)), np.empty((SCRATCH, n))
    force, slope = np.empty(n), np.empty(n)
    law_constants(a, h, soft, constants, scratch, force, slope)
    apply_laws(s, constants, scratch, scratch.view(np.int64), force, slope)
    return force
