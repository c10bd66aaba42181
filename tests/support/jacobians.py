"""Jacobians of the maps of a section's quadrilaterals."""

import numpy as np
from numpy.typing import NDArray

from fem_reference.sector import Section
from gearbench.compliance.bases import gauss


def jacobians(section: Section, count: int) -> NDArray:
    """∂(R, θ)/∂(s, t) at count² Gauss points of each quadrilateral, (quadrilateral, point); positive."""
    points, _ = gauss(count)
    s, t = (a.ravel() for a in np.meshgrid(points, points))
    found = [at(s, t) for at in section.maps]
    return np.array([R_t * theta_s - R_s * theta_t for _, _, R_s, R_t, theta_s, theta_t in found])
