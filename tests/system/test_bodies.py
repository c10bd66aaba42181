"""Bodies from other programs: a piece of a shaft as a body, springs in series, formats, units, faults."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from gearbench.dynamics.analysis import response
from gearbench.errors import InputError
from gearbench.scene_file import parse_scene
from gearbench.schema import read
from gearbench.simulation import simulate
from gearbench.system.body import Body
from gearbench.system.body_files import read_matrix
from tests.support.bodies import ENDS, labels, matrix_market, netcdf, piece, punch
from tests.support.systems import shafts, spur_scene

#: N/µm radial and axial, N·m/mrad; the same in N/mm and N·mm.
BEARING = {"radial_stiffness": 200.0, "axial_stiffness": 80.0, "tilting_stiffness": 0.3}
SPRINGS = (2e5, 2e5, 8e4, 3e5, 3e5)
SPEEDS = [900.0, 3100.0, 5200.0]


def whole():
    """A pinion on a shaft of 200 mm, with a node where ``cut`` divides it."""
    ends = [{"position": p, **BEARING} for p in (0.0, 200.0)]
    return spur_scene(shafts({"bearings": ends, "discs": [{"position": 120.0}]}), helix=15.0, segments=10)


def cut(body):
    """The same shaft, with its last 80 mm and their bearing as a body."""
    short = {
        "sections": [{"length": 120.0, "diameter": 40.0}],
        "bearings": [{"position": 0.0, **BEARING}],
    }
    joints = [{"node": "near", "shaft": "input", "position": 120.0}]
    bodies = [{"name": "end", "joints": joints, **body}]
    return spur_scene(shafts(short, bodies=bodies), helix=15.0, segments=10)


def reduced(K, M, modes):
    """Craig and Bampton's matrices: motions of the first node, and ``modes`` of the rest with this node held."""
    inside = slice(6, None)
    values, vectors = eigh(K[inside, inside], M[inside, inside])
    T = np.zeros((len(K), 6 + modes))
    T[:6, :6] = np.eye(6)
    T[inside, :6] = -np.linalg.solve(K[inside, inside], K[inside, :6])
    T[inside, 6:] = vectors[:, :modes]
    assert values[0] > 0
    return T.T @ K @ T, T.T @ M @ T


def body_of(form, folder):
    K, M = piece(support=SPRINGS)
    if form == "matrices":
        return {"file": str(netcdf(folder / "end.nc", labels(), stiffness=K, mass=M))}
    if form == "modes":
        values, vectors = eigh(K, M)
        frequency = np.sqrt(np.maximum(values, 0)) / (2 * np.pi)
        return {"file": str(netcdf(folder / "end.nc", labels(), frequency=frequency, shape=vectors.T))}
    K, M = reduced(K, M, 12 if form == "all fixed modes" else 0)
    matrix_market(folder, K=K, M=M)
    return {"stiffness": str(folder / "K.mtx"), "mass": str(folder / "M.mtx"), "nodes": ["near"]}


@pytest.mark.parametrize("form", ["matrices", "modes", "all fixed modes", "none of them"])
def test_piece_of_a_shaft_as_a_body_answers_as_the_shaft(form, tmp_path):
    """Contact and response agree; without inner modes (Guyan) the static contact does."""
    one, two = whole(), cut(body_of(form, tmp_path))
    for name in ("transmission_error", "mesh_stiffness"):
        assert_allclose(simulate(two)[name], simulate(one)[name], rtol=1e-8)
    if form == "none of them":
        return
    one, two = (response(scene, speed=SPEEDS, harmonics=4) for scene in (one, two))
    assert_allclose(two["natural_frequency"], one["natural_frequency"], rtol=1e-6)
    assert_allclose(two["mesh_force_amplitude"], one["mesh_force_amplitude"], rtol=1e-6)
    name = "bearing_force_amplitude"
    force = one[name].sel(bearing="input 1")
    assert_allclose(two[name].sel(bearing="input 1"), force, atol=1e-7 * float(force.max()))


def seated_in(body):
    """Bearings of the pinion's shaft on nodes a and b of a body."""
    return [{"position": p, **BEARING, "on": {"body": body, "node": n}} for p, n in ((0.0, "a"), (200.0, "b"))]


def on_springs(folder, **mass):
    """Bearings of the pinion's shaft on nodes of a body, which is held there by springs (x, y, z) to the ground."""
    names = [(node, d) for node in "ab" for d in "xyz"]
    file = netcdf(folder / "housing.nc", names, stiffness=1e3 * np.diag([300.0, 300.0, 120.0] * 2), **mass)
    ends = seated_in("housing")
    bodies = [{"name": "housing", "file": str(file)}]
    return spur_scene(shafts({"bearings": ends}, bodies=bodies), helix=15.0, segments=10)


def test_bearing_on_a_spring_is_one_in_series(tmp_path):
    """200 and 300 N/µm in series are 120 N/µm; a body without mass follows quasi-statically."""
    series = {"radial_stiffness": 120.0, "axial_stiffness": 48.0, "tilting_stiffness": 0.3}
    plain = spur_scene(shafts({"bearings": [{"position": p, **series} for p in (0.0, 200.0)]}), helix=15.0, segments=10)
    seated = on_springs(tmp_path)
    for name in ("transmission_error", "mesh_stiffness"):
        assert_allclose(simulate(seated)[name], simulate(plain)[name], rtol=1e-8)
    one, two = (response(scene, speed=SPEEDS, harmonics=4) for scene in (plain, seated))
    assert_allclose(two["bearing_force_amplitude"], one["bearing_force_amplitude"], rtol=1e-6, atol=1e-7)


def test_forces_of_both_shafts_meet_in_the_housing(tmp_path):
    """If all bearings are on one node, the forces of pinion and wheel cancel and do not load the housing's springs."""
    names = [("a", d) for d in "xyz"]
    file = netcdf(tmp_path / "soft.nc", names, stiffness=1e3 * np.diag([20.0, 20.0, 20.0]), mass=1e-3 * np.eye(3))
    on = {"on": {"body": "housing", "node": "a"}}
    pinion = [{"position": p, **BEARING} for p in (0.0, 200.0)]
    wheel = [{"position": p, "radial_stiffness": 900.0, "axial_stiffness": 400.0} for p in (0.0, 100.0)]
    slender = {"sections": [{"length": 100.0, "diameter": 80.0}]}
    plain = spur_scene(shafts({"bearings": pinion}, slender | {"bearings": wheel}), helix=15.0, segments=10)
    seats = [[bearing | on for bearing in bearings] for bearings in (pinion, wheel)]
    bodies = [{"name": "housing", "file": str(file)}]
    both = shafts({"bearings": seats[0]}, slender | {"bearings": seats[1]}, bodies=bodies)
    soft = spur_scene(both, helix=15.0, segments=10)
    for name in ("transmission_error", "mesh_stiffness"):
        assert_allclose(simulate(soft)[name], simulate(plain)[name], rtol=1e-7)
    # the pinion's shaft alone on the same springs does move
    one = shafts({"bearings": seats[0]}, slender | {"bearings": wheel}, bodies=bodies)
    only = spur_scene(one, helix=15.0, segments=10)
    alone, held = (float(simulate(scene)["transmission_error_mean"]) for scene in (only, plain))
    assert alone > held + 20.0


def test_three_formats_are_one_body(tmp_path):
    K, M = piece(support=SPRINGS)
    netcdf(tmp_path / "end.nc", labels(("1", "2", "3")), stiffness=K, mass=M)
    matrix_market(tmp_path, K=K, M=M)
    places = [(grid, component) for grid in (1, 2, 3) for component in range(1, 7)]
    punch(tmp_path / "end.pch", places, KAAX=K, MAAX=M)
    market = {"stiffness": str(tmp_path / "K.mtx"), "mass": str(tmp_path / "M.mtx"), "nodes": ["1", "2", "3"]}
    files = [{"file": str(tmp_path / name)} for name in ("end.nc", "end.pch")]
    one, *others = (read(Body, {"name": "end", **given}).condensed for given in (*files, market))
    assert_allclose(one.stiffness, K)
    for other in others:
        for name in ("stiffness", "mass"):
            wanted = getattr(one, name)
            # ten digits are punched
            assert_allclose(getattr(other, name), wanted, atol=1e-9 * np.abs(wanted).max())
        assert_allclose([other.nodes[n] for n in "123"], [one.nodes[n] for n in "123"])


def test_narrow_punch_with_scalar_points(tmp_path):
    """Fields of eight characters; generalised coordinates are on scalar points, which are not nodes."""
    K = np.array([[40.5, -10.0, 0.0], [-10.0, 30.0, 5.0], [0.0, 5.0, 20.0]])
    punch(tmp_path / "b.pch", [(101, 1), (101, 2), (9001, 0)], wide=False, KAAX=K)
    found = read(Body, {"name": "b", "file": str(tmp_path / "b.pch")}).condensed
    assert_allclose(found.stiffness, K)
    assert list(found.nodes) == ["101"]
    assert_allclose(found.nodes["101"][:2], np.eye(3)[:2])
    assert not found.mass.any()


def test_units_and_axes(tmp_path):
    """The same piece in metres, with its axes named z, x, y, has the same compliance between its nodes."""
    K, M = piece(support=(*SPRINGS, 1e6))
    plain = read(Body, {"name": "a", "file": str(netcdf(tmp_path / "a.nc", labels(), stiffness=K, mass=M))}).condensed
    scale = np.tile([1e-3] * 3 + [1.0] * 3, 3)
    # u_m = u_mm/1000 and J = N·mm/1000
    metres = [A / scale[:, None] / scale / 1e3 for A in (K, M)]
    names = [(node, turned) for node in ENDS for turned in ("z", "x", "y", "rz", "rx", "ry")]
    file = netcdf(tmp_path / "b.nc", names, stiffness=metres[0], mass=metres[1])
    other = read(
        Body, {"name": "b", "file": str(file), "units": "m", "x": [0.0, 0.0, 1.0], "z": [0.0, 1.0, 0.0]}
    ).condensed
    for n in ENDS:
        for m in ENDS:
            one, two = (b.nodes[n] @ np.linalg.solve(b.stiffness, b.nodes[m].T) for b in (plain, other))
            assert_allclose(two, one, atol=1e-9 * np.abs(one).max())
    values = [eigh(b.stiffness, b.mass, eigvals_only=True) for b in (plain, other)]
    assert_allclose(values[1], values[0], rtol=1e-8)


def test_scene_with_a_body_survives_its_file_and_notes_a_change(tmp_path):
    scene = on_springs(tmp_path)
    tables = scene.to_mapping()
    assert len(tables["system"]["bodies"][0]["file_sha256"]) == 64
    again = parse_scene(tables)
    assert again == scene
    assert again.digest == scene.digest
    netcdf(tmp_path / "housing.nc", [("a", "x"), ("b", "x")], stiffness=np.eye(2))
    with pytest.raises(InputError, match=r"system.bodies.0.file_sha256 = given: .* has changed"):
        parse_scene(tables)


def test_body_that_nothing_holds(tmp_path):
    K = 1e5 * np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(3))
    names = [(node, d) for node in "ab" for d in "xyz"]
    file = netcdf(tmp_path / "loose.nc", names, stiffness=K, mass=1e-3 * np.eye(6))
    ends = seated_in("frame")
    scene = spur_scene(shafts({"bearings": ends}, bodies=[{"name": "frame", "file": str(file)}]), segments=10)
    with pytest.raises(InputError, match="free to move"):
        simulate(scene)


def test_damper_on_a_body_without_mass_is_refused(tmp_path):
    tables = on_springs(tmp_path).to_mapping()
    tables["system"]["shafts"][0]["bearings"][0]["damping"] = 100.0
    with pytest.raises(InputError, match="a damper on a body without mass"):
        response(parse_scene(tables), speed=1000.0)


def joint(**other):
    return {"node": "a", "shaft": "input", "position": 1.0, **other}


SPRING = 1e5 * np.eye(3)
XYZ = [("a", d) for d in "xyz"]
FAULTS = {
    "no file": ({}, r"bodies.0.file = missing: give one of file and stiffness"),
    "no netCDF": ({"file": "text.nc"}, r"text.nc: must be a netCDF file"),
    "bad DMIG": ({"file": "bad.pch"}, r"bad.pch, line 2: component 7: must be 0 to 6"),
    "no Matrix Market": ({"stiffness": "text.nc", "nodes": ["a"]}, r"must be a Matrix Market file"),
    "no nodes": ({"stiffness": "K.mtx"}, r"nodes = 0: must be 1 to 1: six rows each of 6"),
    "sizes": ({"stiffness": "K.mtx", "mass": "M.mtx", "nodes": ["a"]}, r"mass = 3 × 3: must be as large"),
    "unsymmetric": ({"file": "skew.nc"}, r"bodies.0.stiffness = not symmetric: must be symmetric"),
    "negative": ({"file": "negative.nc"}, r"stiffness = a negative eigenvalue"),
    "direction": ({"file": "odd.nc"}, r"direction = up: must be one of x, y, z, rx, ry, rz"),
    "unknown node": ({"file": "b.nc", "joints": [joint(node="q")]}, r"node = q: must be one of a"),
    "untouched": ({"file": "b.nc"}, r"the body is unconnected: add a bearing or joint"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_one_line(fault, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    netcdf(tmp_path / "b.nc", XYZ, stiffness=SPRING)
    netcdf(tmp_path / "skew.nc", XYZ, stiffness=SPRING + np.triu(SPRING[::-1]))
    netcdf(tmp_path / "negative.nc", XYZ, stiffness=SPRING - 2 * SPRING[0, 0] * np.diag([1.0, 0, 0]))
    netcdf(tmp_path / "odd.nc", [("a", "up"), ("a", "x"), ("a", "y")], stiffness=SPRING)
    matrix_market(tmp_path, K=1e5 * np.eye(6), M=np.eye(3))
    for name in ("text.nc", "text.pch"):
        (tmp_path / name).write_text("no matrix at all\n")
    (tmp_path / "bad.pch").write_text("DMIG,KAAX,0,6,2,0,,,2\nDMIG,KAAX,1,7,,1,1,2.0\n")
    body, line = FAULTS[fault]
    with pytest.raises(InputError, match=line) as error:
        spur_scene(shafts(bodies=[{"name": "housing", **body}]))
    assert "\n" not in str(error.value)


def test_unknown_body_of_a_bearing_is_named():
    ends = [{"position": p, **BEARING, "on": {"body": "housing", "node": "a"}} for p in (0.0, 200.0)]
    with pytest.raises(InputError, match=r"system.shafts.0.bearings.0.on.body = housing: allowed:"):
        spur_scene(shafts({"bearings": ends}))


@pytest.mark.parametrize("form", ["array", "coordinate"])
@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("kind", ["real", "integer"])
def test_matrix_market_files_are_read_as_scipy_reads_them(tmp_path, form, symmetry, kind):
    from scipy.io import mmread, mmwrite
    from scipy.sparse import coo_array

    A = np.random.default_rng(1).integers(-3, 4, size=(6, 6)).astype(float if kind == "real" else int)
    A = A + A.T if symmetry == "symmetric" else A
    mmwrite(tmp_path / "a.mtx", coo_array(A) if form == "coordinate" else A, symmetry=symmetry, field=kind)
    found, _ = read_matrix("stiffness", str(tmp_path / "a.mtx"))
    assert_allclose(found, A, rtol=0, atol=0)
    whole = mmread(tmp_path / "a.mtx")
    assert_allclose(found, whole.toarray() if form == "coordinate" else whole, rtol=0, atol=0)


HEADER = "%%MatrixMarket matrix {} {} {}\n% a comment\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (HEADER.format("coordinate", "real", "general") + "2 2 1\n1 1 1.0\n2 2 1.0\n", "2 entries, 1 expected"),
        (HEADER.format("coordinate", "real", "general") + "2 2 1\n3 1 1.0\n", "rows and columns must be 1 to 2"),
        (HEADER.format("coordinate", "real", "general") + "2 2 1\n1.5 1 1.0\n", "must be whole numbers"),
        (HEADER.format("coordinate", "real", "general") + f"2 2 {10**17}\n1 1 1\n", "1 entries, 1000000"),
        (HEADER.format("array", "real", "symmetric") + "2 2\n1.0\n2.0\n", "2 entries, 3 expected"),
        (HEADER.format("coordinate", "real", "skew-symmetric") + "2 2 1\n2 1 1.0\n", "must be real and square"),
        (HEADER.format("coordinate", "real", "general") + "2 2 1\n1 1 1\x00.0\n", "must be a Matrix Market file"),
    ],
)
def test_damaged_matrix_market_files_are_one_line(tmp_path, text, reason):
    (tmp_path / "K.mtx").write_text(text, encoding="ascii")
    with pytest.raises(InputError, match=reason) as fault:
        read_matrix("stiffness", str(tmp_path / "K.mtx"))
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize(
    ("value", "reason"), [(np.nan, "shape = not finite"), (1e200, r"shape = 1e\+200: must be at most 1e\+60")]
)
def test_shapes_of_modes_are_numbers_that_can_be(tmp_path, value, reason):
    K, M = piece(support=SPRINGS)
    values, vectors = eigh(K, M)
    vectors[3, 3] = value
    frequency = np.sqrt(np.maximum(values, 0)) / (2 * np.pi)
    file = netcdf(tmp_path / "end.nc", labels(), frequency=frequency, shape=vectors.T)
    with pytest.raises(InputError, match=reason):
        cut({"file": str(file)})
