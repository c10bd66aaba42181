"""What compiled kernels read logarithms off the bits of doubles with, and guess the level of the law.

The functions are written into the loops that call them, which become vector instructions.
"""

from __future__ import annotations

import numpy as np

from gearbench.compiled import FUSED, part

# Bits of a double: mantissa mask, exponent of 1.0, and the trick that reads an exponent field as a double.
MANTISSA, ONE = np.int64(0x000FFFFFFFFFFFFF), np.int64(0x3FF0000000000000)
MAGIC, MAGIC_VALUE = np.int64(0x4330000000000000), 4503599627370496.0 + 1023.0
LN2, SQRT2 = 0.6931471805599453, 1.4142135623730951

# ln m on [1, 2) to 2e-6, only to start from (Chebyshev interpolation)
LN_0, LN_1, LN_2 = -2.0996478486768844, 4.205234841459749, -3.647120395291447
LN_3, LN_4, LN_5, LN_6 = 2.226943460753641, -0.8520795951448831, 0.18370084115152, -0.017029610589036435
# rational approximation of ln L as a function of ℓ = L − ln L on [2 − ln 2, 120], to 1.2e-4, only to start from
TOP_0, TOP_1, TOP_2 = -9.995550735434079e-05, -0.0249708843354656, -0.6947243186683587
TOP_3, TOP_4, TOP_5 = -1.9526075373671652, 2.675457294772817, -0.21083468541969874
BOTTOM_0, BOTTOM_1, BOTTOM_2 = -1.3412269292221055e-05, -0.005223620965804569, -0.2331840533201535
BOTTOM_3, BOTTOM_4 = -1.5703000265079305, -0.14966709188859736


@part(FUSED)
def level_start(kappa, mantissa, exponent):
    """Of x = ``mantissa`` · 2^``exponent``: ℓ = κ − ln x, and of the first guess of L with L − ln L = ℓ the parts.

    L = product² · inverse, and x/L = x · bottom² · inverse.
    """
    m = mantissa
    crude = (((((LN_6 * m + LN_5) * m + LN_4) * m + LN_3) * m + LN_2) * m + LN_1) * m + LN_0
    y = kappa - ((exponent - MAGIC_VALUE) * LN2 + crude)
    top = ((((TOP_0 * y + TOP_1) * y + TOP_2) * y + TOP_3) * y + TOP_4) * y + TOP_5
    bottom = ((((BOTTOM_0 * y + BOTTOM_1) * y + BOTTOM_2) * y + BOTTOM_3) * y + BOTTOM_4) * y + 1.0
    product = y * bottom + top
    return y, bottom, product, 1.0 / (bottom * product)


@part(FUSED)
def logarithm_parts(mantissa, exponent):
    """e, f and r with ln x = e ln 2 + 2 f r to the last digits, of x = ``mantissa`` · 2^``exponent``."""
    m, e = mantissa, exponent - MAGIC_VALUE
    large = m > SQRT2
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
    return e, f, r
