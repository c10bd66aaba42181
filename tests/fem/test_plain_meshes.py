"""Whole gears by two routes that share no element and no equations: condensed sector, plain mesh of hexahedra."""

from __future__ import annotations

import numpy as np
import pytest

from fem_reference.refinement import refined_compliance
from fem_reference.section import Body
from gearbench import read_scene
from gearbench.effects.teeth import fe_body
from tests.support.paths import EXAMPLES
from tests.support.plain_meshes import plain_blocks
from tests.support.webbed import webbed

ORDER = (3, 3)


def thin_rim() -> Body:
    """A spur pinion in use, on a rim of 1.6 modules."""
    return fe_body(read_scene(EXAMPLES / "gears" / "thin_rim.toml").pair, 0, on_body=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "along", "limit"),
    [
        (webbed(12, 3.0, 0.0, 0.0), (1, 1, 1), 0.006),
        (webbed(12, 3.0, 20.0, 0.4), (1, 1, 1), 0.006),
        (thin_rim(), (2,), 0.007),
    ],
)
def test_plain_hexahedra_agree_within_both_error_bars(body, along, limit, steel):
    """Teeth −1, 0, 1; two meshes, whose error bar is what Richardson's value adds to the finer one."""
    found = refined_compliance(body, steel, 0.002, ORDER)
    n = found.neighbours
    coarse, fine = (plain_blocks(body, steel, ORDER, k, [k * each for each in along]) for k in (1, 2))
    plain = fine + (fine - coarse) / (2**2 - 1)
    bar = np.linalg.norm(plain - fine) / np.linalg.norm(plain)
    difference = np.linalg.norm(found.blocks[n - 1 : n + 2] - plain) / np.linalg.norm(plain)
    assert difference < min(found.error + bar, limit)
    assert bar < 0.015
