"""Picture of a finite element mesh: its surface, drawn by matplotlib."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.role import Role
from gearbench.scene import Scene
from gearbench.scene_file import parse_scene
from gearbench.validation.reference import finite_elements

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from fem_reference.tooth_mesh import ToothMesh

#: Colours of the surface: the loaded flank, what is held, the rest.
LOADED, HELD, OTHER = "#E69F00", "#0072B2", "#DDDDDD"
#: Direction of the light.
_LIGHT = np.array([-0.35, -0.6, 0.72])


def finest_mesh(reference: Scene, role: Role, meshes: int, element: str) -> ToothMesh:
    """The last of the ``meshes`` that the compliance of one gear was refined over."""
    from fem_reference.refinement import FAMILY, FINE_FAMILY, RIM_FAMILY, mesh_cells
    from fem_reference.tooth_mesh import tooth_mesh

    effect = finite_elements(reference)
    body = effect.body(reference.pair, role, reference.effects_by_name)
    family = RIM_FAMILY if body.bore_radius is not None else FAMILY if effect.accuracy >= 0.005 else FINE_FAMILY
    return tooth_mesh(body, mesh_cells(body, family[meshes - 1]), element)


def surface(tooth: ToothMesh) -> tuple[NDArray, list[str]]:
    """Outlines (facet, 8, 3) [mm] of the facets of the surface, edge middles included, and the colour of each."""
    from fem_reference.tooth_mesh import edges_of

    mesh = tooth.mesh
    facets = mesh.boundary_facets()
    colour = np.full(mesh.facets.shape[1], OTHER, dtype="U7")
    for name, chosen in mesh.boundaries.items():
        if name in tooth.body.held:
            colour[chosen] = HELD
        elif name == "right_flank":
            colour[chosen] = LOADED
    around = edges_of(mesh, facets)
    ends, next_ends = mesh.edges[:, around], mesh.edges[:, np.roll(around, -1, axis=0)]
    shared = np.where((ends[0] == next_ends[0]) | (ends[0] == next_ends[1]), ends[0], ends[1])
    middle = mesh.dofs.edge_dofs[0][around]
    outline = np.stack([middle, shared], axis=1).reshape(-1, len(facets))
    return mesh.doflocs[:, outline].transpose(2, 1, 0), colour[facets].tolist()


def draw_mesh(tooth: ToothMesh, axes: Any) -> None:
    """Draw the surface of a mesh on three-dimensional axes."""
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    corners, colours = surface(tooth)
    # face width to the back, tooth upwards
    points = corners[..., [0, 2, 1]]
    normal = np.cross(points[:, 4] - points[:, 0], points[:, 6] - points[:, 2])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    shade = 0.8 + 0.2 * np.abs(normal @ _LIGHT / np.linalg.norm(_LIGHT))
    faces = [tuple(np.clip(s * np.array(to_rgb(c)), 0, 1)) for s, c in zip(shade, colours, strict=True)]
    width = 0.35 if len(points) < 4000 else 0.12
    axes.add_collection3d(Poly3DCollection(list(points), facecolors=faces, edgecolors="0.25", linewidths=width))
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    axes.view_init(elev=22, azim=-50 if tooth.body.gear.beta == 0 else -60)
    axes.set(xlabel="x [mm]", ylabel="z [mm]", zlabel="y [mm]")
    axes.locator_params(nbins=4)
    axes.set_yticks([0, tooth.body.gear.face_width])


def mesh_figure(dataset: xr.Dataset) -> Figure:
    """Finest meshes of both gears of a comparison, the loaded flank and the held surface coloured."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    reference = parse_scene(tomllib.loads(dataset.attrs["reference_scene"]))
    figure = Figure(figsize=(9.5, 4.8))
    for role, name in zip(Role, dataset["gear"].values, strict=True):
        found = dataset.isel(gear=int(role))
        meshes = int(found["reference_meshes"])
        tooth = finest_mesh(reference, role, meshes, dataset.attrs["reference_element"])
        axes = figure.add_subplot(1, 2, role + 1, projection="3d")
        draw_mesh(tooth, axes)
        unknowns, error = int(found["reference_unknowns"]), float(found["reference_error"])
        axes.set_title(
            f"{name}: {tooth.mesh.nelements} elements, {unknowns} unknowns,\nestimated error {100 * error:.2g} %",
            fontsize=10,
        )
    patches = [Patch(color=LOADED, label="loaded flank"), Patch(color=HELD, label="held")]
    figure.legend(handles=patches, loc="lower center", ncols=2, frameon=False)
    figure.subplots_adjust(left=0.02, right=0.95, top=0.88, bottom=0.1, wspace=0.12)
    return figure
