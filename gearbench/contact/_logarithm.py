"""Numbers from which compiled kernels read logarithms off the bits of doubles, and guess the level of the law."""

from __future__ import annotations

import numpy as np

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
