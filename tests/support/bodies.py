"""Bodies for tests, and their files: netCDF, Matrix Market, punched DMIG."""

from gearbench.system.body_files import DIRECTIONS
from gearbench.system.schema import Shaft, ShaftSection
from gearbench.system.shaft_model import ShaftModel

ENDS = ("near", "middle", "far")


def piece(length=80.0, diameter=40.0, support=()):
    """K and M of a free shaft of two elements, with ``support`` springs (x, y, z, rx, ry) [N/mm] at the far end."""
    model = ShaftModel(shaft=Shaft(name="s", sections=(ShaftSection(length=length, diameter=diameter),)), faces=())
    assert len(model.nodes) == 3
    K = model.stiffness.copy()
    for d, k in enumerate(support):
        K[12 + d, 12 + d] += k
    return K, model.mass


def labels(nodes=ENDS, more=0):
    return [(node, d) for node in nodes for d in DIRECTIONS] + [("", "")] * more


def netcdf(path, labels, **variables):
    """Write a body: ``stiffness`` and ``mass`` (dof, dof), ``frequency`` (mode,) and ``shape`` (mode, dof)."""
    import xarray as xr

    dims = {
        "stiffness": ("dof", "dof_too"),
        "mass": ("dof", "dof_too"),
        "frequency": ("mode",),
        "shape": ("mode", "dof"),
    }
    data = xr.Dataset({name: (dims[name], values) for name, values in variables.items()})
    coords = {name: ("dof", [label[k] for label in labels]) for k, name in enumerate(("node", "direction"))}
    data.assign_coords(coords).to_netcdf(path, engine="h5netcdf")
    return path


def matrix_market(folder, **matrices):
    from scipy.io import mmwrite
    from scipy.sparse import coo_array

    for name, A in matrices.items():
        mmwrite(folder / f"{name}.mtx", coo_array(A), symmetry="symmetric", precision=17)


def punch(path, places, *, wide=True, **matrices):
    """Write the lower triangles of ``matrices`` as DMIG, in fields of 16 characters, or of 8 unless ``wide``.

    ``places`` holds the (grid point, component) of each row.
    """
    lines = ["$ punched"]
    for name, A in matrices.items():
        lines.append(f"DMIG    {name:<8}{0:>8}{6:>8}{2:>8}{0:>8}{'':8}{len(A):>8}")
        for j, (grid, component) in enumerate(places):
            entries = [(places[i], A[i, j]) for i in range(j, len(A)) if A[i, j]]
            if wide:
                lines.append(f"DMIG*   {name:<16}{grid:>16}{component:>16}")
                lines += [f"*       {g:>16}{c:>16}{_number(value, 9, 16)}" for (g, c), value in entries]
            elif entries:
                (g, c), value = entries[0]
                lines.append(f"DMIG    {name:<8}{grid:>8}{component:>8}{'':8}{g:>8}{c:>8}{value:>8.1f}")
                lines += [f"+       {g:>8}{c:>8}{value:>8.1f}" for (g, c), value in entries[1:]]
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    return path


def _number(value, digits, width):
    return f"{value:>{width}.{digits}E}".replace("E", "D")
