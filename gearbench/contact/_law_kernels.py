"""Compiled contact law at a point, which the compiler inlines into the loops over segments and samples.

The law is that of ``gearbench.contact.law``, with which the tests compare it. The level L = a/h − ln P solves
L − ln L = κ − ln s with κ = a/h + ln h. ``level_start`` guesses L by a rational approximation; ``log_law`` improves the
guess by one step of Halley's method and, if ``exact``, by a Newton step. Logarithms split a number into mantissa and
exponent. There are no branches, so loops become vector instructions. Callers have a short loop for each of the two
functions, which is faster than one long loop.
"""

from __future__ import annotations

import math

import numpy as np

from gearbench.compiled import FUSED, SUMS, bit_casts, entry, part
from gearbench.contact.law import LARGEST_EXPONENT, TANGENT_FROM

#: Number of rows of the constants of the law, and of its scratch.
CONSTANTS, SCRATCH = 7, 2
#: Smaller compressions are replaced by this one; its force is negligible.
LEAST = 1e-290

_bits, _double = bit_casts()
# Bits of a double: mask of the mantissa, bits of 1.0, number of bits of the mantissa.
_MANTISSA, _ONE, _PLACES = np.uint64(0x000FFFFFFFFFFFFF), np.uint64(0x3FF0000000000000), np.uint64(52)
# An integer written into the mantissa of 2⁵² is read as the double 2⁵² + integer. Exponents are stored with 1023 added.
_BITS_OF_2_52, _BIASED_2_52 = np.uint64(0x4330000000000000), 4503599627370496.0 + 1023.0
_LN2, _SQRT2 = 0.6931471805599453, 1.4142135623730951

# ln m on [1, 2) to 2e-6, for the first guess (Chebyshev interpolation)
_LN_0, _LN_1, _LN_2 = -2.0996478486768844, 4.205234841459749, -3.647120395291447
_LN_3, _LN_4, _LN_5, _LN_6 = 2.226943460753641, -0.8520795951448831, 0.18370084115152, -0.017029610589036435
# rational approximation of ln L as a function of ℓ = L − ln L ≥ 2 − ln 2: L is accurate to 6e-5 up to ℓ = 120, and to
# 2e-4 up to ℓ = 760, the range of doubles
_TOP_0, _TOP_1, _TOP_2 = -9.995550735434079e-05, -0.0249708843354656, -0.6947243186683587
_TOP_3, _TOP_4, _TOP_5 = -1.9526075373671652, 2.675457294772817, -0.21083468541969874
_BOTTOM_0, _BOTTOM_1, _BOTTOM_2 = -1.3412269292221055e-05, -0.005223620965804569, -0.2331840533201535
_BOTTOM_3, _BOTTOM_4 = -1.5703000265079305, -0.14966709188859736


@part(FUSED)
def split(x):
    """Mantissa in [1, 2) and exponent of a positive double."""
    bits = _bits(x)
    return _double((bits & _MANTISSA) | _ONE), _double((bits >> _PLACES) | _BITS_OF_2_52) - _BIASED_2_52


@part(FUSED)
def level_start(x, kappa):
    """First guess of the L that solves L − ln L = κ − ln x, and x / L."""
    m, exponent = split(x)
    crude = (((((_LN_6 * m + _LN_5) * m + _LN_4) * m + _LN_3) * m + _LN_2) * m + _LN_1) * m + _LN_0
    y = kappa - (exponent * _LN2 + crude)
    top = ((((_TOP_0 * y + _TOP_1) * y + _TOP_2) * y + _TOP_3) * y + _TOP_4) * y + _TOP_5
    bottom = ((((_BOTTOM_0 * y + _BOTTOM_1) * y + _BOTTOM_2) * y + _BOTTOM_3) * y + _BOTTOM_4) * y + 1.0
    product = y * bottom + top
    inverse = 1.0 / (bottom * product)
    return product * product * inverse, x * bottom * bottom * inverse


@part(FUSED)
def logarithm(x):
    """ln x of a positive double, to the last digits."""
    m, e = split(x)
    large = m > _SQRT2
    m = 0.5 * m if large else m
    e = e + 1.0 if large else e
    f = (m - 1.0) / (m + 1.0)
    g = f * f
    r = 1.0 / 19
    r = r * g + 1.0 / 17
    r = r * g + 1.0 / 15
    r = r * g + 1.0 / 13
    r = r * g + 1.0 / 11
    r = r * g + 1.0 / 9
    r = r * g + 1.0 / 7
    r = r * g + 1.0 / 5
    r = r * g + 1.0 / 3
    r = r * g + 1.0
    return e * _LN2 + 2.0 * f * r


@part(FUSED)
def log_law(s, level, quotient, edge, kappa, h, per_h, exact):
    """Force, slope dP/ds and L under a compression s > 0.

    ``level`` and ``quotient`` come from ``level_start`` of min(s, edge); from the compression ``edge`` on, the tangent
    continues the law; per_h = 1/h. Results are accurate to rounding if ``exact``; otherwise force and slope are to
    1e-12, and L is not meaningful.
    """
    log = logarithm(quotient)
    residual = level - kappa + log
    slope = level - 1.0
    below = slope * slope - 0.5 * residual
    above = level * (below - residual * slope)  # L = above / below
    if exact:
        change = -residual * slope / below
        # ln(1 + change) for a change of at most 2e-4
        log -= change * (1.0 - change * (0.5 - change * (1.0 / 3 - change * 0.25)))
        L = level + level * change
        above, below = L - (L - kappa + log) * L / (L - 1.0), 1.0
    scale = 1.0 / (h * above * (above - below))
    over = s - edge
    force = min(s, edge) * below * (above - below) * scale + max(over, 0.0) * per_h
    return force, per_h if over > 0.0 else below * above * scale, above


@part()
def law(s, a, h):
    """Force P, slope dP/ds and energy ∫P ds of a single point compressed by s under g(P) = P (a − h ln P)."""
    if s <= 0.0:
        return 0.0, 0.0, 0.0
    if h == 0.0:
        return s / a, 1.0 / a, 0.5 * s * s / a
    kappa, edge = a / h + math.log(h), tangent_edge(a, h)
    x = max(min(s, edge), LEAST)
    level, quotient = level_start(x, kappa)
    force, slope, L = log_law(s, level, quotient, edge, kappa, h, 1.0 / h, True)
    return force, slope, energy_of(force, max(s - edge, 0.0), h, L)


@part()
def tangent_edge(a, h):
    """Compression 2h P₀ from which the tangent continues the law, with P₀ of ``law.tangent_force``."""
    return TANGENT_FROM * h * math.exp(min(a / h, LARGEST_EXPONENT) - TANGENT_FROM)


@part(FUSED)
def energy_of(force, over, h, L):
    """∫P ds of the logarithmic law; ``over`` is the part of the compression that lies on the tangent."""
    low = force - over / h
    return h * low * low * (0.5 * L - 0.25) + over * (low + 0.5 * over / h)


@part(SUMS)
def apply_laws(s, constants, scratch, force, weight):
    """Fill forces and slopes of segments compressed by s; returns ΣP, ΣdP/ds and ∫ΣP ds.

    ``constants`` come from ``law_constants``, which explains them; ``scratch`` is (2, segment).
    """
    a, h, kappa, edge, sigma, P_sigma, excess = (
        constants[0], constants[1], constants[2], constants[3], constants[4], constants[5], constants[6]
    )  # fmt: skip
    level, quotient = scratch[0], scratch[1]
    for j in range(s.size):
        level[j], quotient[j] = level_start(max(min(s[j] - sigma[j], edge[j]), LEAST), kappa[j])
    total, slope, value = 0.0, 0.0, 0.0
    for j in range(s.size):
        middle, straight = max(s[j] - sigma[j], LEAST), h[j] == 0.0
        per_h = 1.0 / h[j]
        logarithmic, rate, L = log_law(middle, level[j], quotient[j], edge[j], kappa[j], h[j], per_h, True)
        p = middle / a[j] if straight else logarithmic
        w = 1.0 / a[j] if straight else rate
        e = 0.5 * middle * p if straight else energy_of(p, max(middle - edge[j], 0.0), h[j], L)
        # cells of which only the part t is loaded
        t = s[j] / (2.0 * sigma[j]) if sigma[j] > 0.0 else 1.0
        part, on = t < 1.0, s[j] > 0.0
        p = P_sigma[j] * t * t if part else p
        w = P_sigma[j] * t / sigma[j] if part else w
        e = 2.0 / 3.0 * sigma[j] * P_sigma[j] * t * t * t if part else e + excess[j]
        force[j] = p if on else 0.0
        weight[j] = w if on else 0.0
        total += p if on else 0.0
        slope += w if on else 0.0
        value += e if on else 0.0
    return total, slope, value


@part()
def law_constants(a, h, sigma, constants):
    """Fill the rows of ``constants`` (7, segment), from which forces follow.

    They are a, h, κ, the compression from which the tangent continues the law, σ, the force P_σ under which the whole
    cell just touches, and the energy of a fully loaded cell minus the energy of a point at its middle.
    """
    last, log_h = 0.0, 0.0
    for j in range(a.size):
        constants[0, j], constants[1, j], constants[2, j], constants[3, j] = a[j], h[j], 0.0, math.inf
        if h[j] > 0.0:
            if h[j] != last:  # most segments have the same constants
                last, log_h = h[j], math.log(h[j])
            constants[2, j], constants[3, j] = a[j] / h[j] + log_h, tangent_edge(a[j], h[j])
        P_sigma, _, energy = law(sigma[j], a[j], h[j])
        constants[4, j], constants[5, j], constants[6, j] = sigma[j], P_sigma, 2.0 / 3.0 * sigma[j] * P_sigma - energy


@entry()
def law_forces(s, a, h, sigma):
    """Forces and slopes of segments compressed by s."""
    n = s.size
    constants, scratch = np.empty((CONSTANTS, n)), np.empty((SCRATCH, n))
    force, slope = np.empty(n), np.empty(n)
    law_constants(a, h, sigma, constants)
    apply_laws(s, constants, scratch, force, slope)
    return force, slope
