"""Modulation of the mesh stiffness, which excites parametric resonances."""

from numpy.typing import NDArray

from gearbench.plugin import MeshCycle, Metric, Quantity


def modulation(cycle: MeshCycle) -> NDArray:
    """(k_max − k_min)/(k_max + k_min) of curves (…, position), in %."""
    least, most = cycle.mesh_stiffness.min(axis=-1), cycle.mesh_stiffness.max(axis=-1)
    return 100 * (most - least) / (most + least)


MODULATION = Metric(
    name="mesh_stiffness_modulation",
    quantity=Quantity("%", "mod k", "modulation of the mesh stiffness"),
    reduce=modulation,
)
