"""Bodies condensed to nodes by other programs, such as a housing, a carrier or a part of a shaft."""

from __future__ import annotations

from dataclasses import dataclass as plain_dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.schema import STRICT
from gearbench.system.body_files import DIRECTIONS, Matrices, read_body, read_matrix

Text = Annotated[str, Field(min_length=1, max_length=1000)]
Digest = Annotated[str, Field(pattern="[0-9a-f]{64}")]
Axis = tuple[float, float, float]

#: Tolerance for asymmetry and for negative eigenvalues, relative to the largest entry: punched numbers have ten digits,
#: and stiffness against rigid motions is a small difference of large numbers.
ROUNDED = 1e-6
#: Largest entry of a matrix; products of larger numbers would overflow.
LARGEST = 1e60


@dataclass(frozen=True, kw_only=True, config=STRICT)
class BodyNode:
    """A node of a body.

    Parameters
    ----------
    body
        Name of the body.
    node
        Name of the node; in a punch file the number of the grid point.
    """

    body: Text
    node: Text


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Joint:
    """Joint that makes a node of a body move with a section of a shaft, rotations included if the node has them.

    Parameters
    ----------
    node
        Node of the body.
    shaft
        Name of the shaft.
    position
        Position on the shaft [mm].
    """

    node: Text
    shaft: Text
    position: Annotated[float, Field(ge=0.0, le=50000.0)]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Body:
    """A body condensed to nodes by another program: it carries bearings (``on``) or joins shafts.

    Parameters
    ----------
    name
        Name in bearings and messages.
    file
        Matrices or modes (netCDF, or Nastran's punched DMIG), relative to the scene file.
    stiffness, mass
        Matrix Market files instead of ``file``. Without mass the body is massless.
    nodes
        Names of their nodes, six rows each (x, y, z, rx, ry, rz) in this order, followed by rows that have no node.
    units
        Units of the files: "mm" is mm, t, N, s; "m" is m, kg, N, s.
    x, z
        Directions of this scene's axes in the coordinates of the body.
    joints
        Joints with shafts.
    file_sha256, stiffness_sha256, mass_sha256
        SHA-256 of the files; noted when they are read, checked if given.
    """

    name: Text
    file: Text | None = None
    stiffness: Text | None = None
    mass: Text | None = None
    nodes: tuple[Text, ...] = ()
    units: Literal["mm", "m"] = "mm"
    x: Axis = (1.0, 0.0, 0.0)
    z: Axis = (0.0, 0.0, 1.0)
    joints: tuple[Joint, ...] = ()
    file_sha256: Digest | None = None
    stiffness_sha256: Digest | None = None
    mass_sha256: Digest | None = None

    def __post_init__(self) -> None:
        if (self.file is None) == (self.stiffness is None):
            raise InputError("file", self.file or "missing", "give one of file and stiffness")
        if self.file is not None and (self.mass is not None or self.nodes):
            raise InputError(
                "mass" if self.mass else "nodes",
                "given",
                "is for Matrix Market files (stiffness): this file contains it",
            )
        condensed = Condensed.of(self._read(), self.units, self._turn())
        for number, joint in enumerate(self.joints):
            condensed.check(joint.node, f"joints.{number}.node")
            if [other.node for other in self.joints].count(joint.node) > 1:
                raise InputError(f"joints.{number}.node", joint.node, "joined twice: each node to one section")
        # not a field: the hashes of the files already identify the contents
        object.__setattr__(self, "_condensed", condensed)

    @property
    def condensed(self) -> Condensed:
        """Matrices of the body in the units and axes of this scene."""
        return self.__dict__["_condensed"]

    def _read(self) -> Matrices:
        """Read the files, and note or check their SHA-256."""
        if self.file is not None:
            matrices, digest = read_body("file", self.file)
            self._note("file", digest)
            return matrices
        assert self.stiffness is not None
        K, digest = read_matrix("stiffness", self.stiffness)
        self._note("stiffness", digest)
        M = None
        if self.mass is not None:
            M, digest = read_matrix("mass", self.mass)
            self._note("mass", digest)
            if len(M) != len(K):
                raise InputError("mass", f"{len(M)} × {len(M)}", f"must be as large as the stiffness, {len(K)}")
        if 6 * len(self.nodes) > len(K) or not self.nodes:
            raise InputError("nodes", f"{len(self.nodes)}", f"must be 1 to {len(K) // 6}: six rows each of {len(K)}")
        labels = [(node, direction) for node in self.nodes for direction in DIRECTIONS]
        labels += [("", "")] * (len(K) - len(labels))
        return Matrices(mass=M, stiffness=K, rows=np.eye(len(K)), labels=tuple(labels))

    def _note(self, key: str, digest: str) -> None:
        """Note the SHA-256 of the file of ``key``; refuse a file that differs from a given one."""
        if getattr(self, f"{key}_sha256") not in (None, digest):
            given = getattr(self, key)
            raise InputError(f"{key}_sha256", "given", f"{given} has changed: its SHA-256 is {digest}")
        object.__setattr__(self, f"{key}_sha256", digest)

    def _turn(self) -> NDArray:
        """Rotation matrix (3, 3) whose rows are the scene's axes in the coordinates of the body."""
        x, z = np.array(self.x), np.array(self.z)
        for key, axis in (("x", x), ("z", z)):
            if not abs(np.linalg.norm(axis) - 1) <= 1e-6:
                raise InputError(key, axis.tolist(), "must be a unit vector")
        if abs(x @ z) > 1e-6:
            raise InputError("z", list(self.z), "must be perpendicular to x")
        return np.array([x, np.cross(z, x), z])


@plain_dataclass(frozen=True, kw_only=True, eq=False)
class Condensed:
    """Condensed body, M η̈ + K η = Rᵀ f, whose nodes move by R η. For modes, η are the modal amplitudes.

    Parameters
    ----------
    mass, stiffness
        M and K, (n, n), scaled so that energies are in N·mm.
    nodes
        R of each node: motion in x, y, z, rx, ry, rz [mm, rad] per coordinate, (6, n); 0 in directions the node lacks.
    """

    mass: NDArray
    stiffness: NDArray
    nodes: dict[str, NDArray]

    @classmethod
    def of(cls, matrices: Matrices, units: str, turn: NDArray) -> Condensed:
        """Create the body from the matrices of a file.

        Raises
        ------
        InputError
            If the matrices are not a valid stiffness and mass, or no node is named.
        """
        scale = 1e3 if units == "m" else 1.0  # 1 J is 1000 N·mm, 1 m is 1000 mm
        n = len(matrices.stiffness)
        K, M = (
            scale * _checked(name, np.zeros((n, n)) if A is None else A)
            for name, A in (("stiffness", matrices.stiffness), ("mass", matrices.mass))
        )
        nodes: dict[str, NDArray] = {}
        for (node, direction), row in zip(matrices.labels, _bounded("shape", matrices.rows), strict=True):
            if not direction:
                continue
            if direction not in DIRECTIONS:
                raise InputError("direction", direction, f"must be one of {', '.join(DIRECTIONS)}, or nothing")
            rows, axis = nodes.setdefault(node, np.zeros((6, n))), DIRECTIONS.index(direction)
            if rows[axis].any():
                raise InputError("direction", f"{node} {direction}", "given twice")
            rows[axis] = row * (scale if axis < 3 else 1.0)
        if not nodes:
            raise InputError("nodes", "none", "must have at least one node with directions x, y, z, rx, ry, rz")
        if not np.array_equal(turn, np.eye(3)):
            for node, rows in nodes.items():
                given = rows.any(axis=1).reshape(2, 3).sum(axis=1)
                if not set(given) <= {0, 3}:
                    raise InputError("x", "given", f"node {node} must have all three directions to be turned")
                nodes[node] = np.concatenate([turn @ rows[:3], turn @ rows[3:]])
        return cls(mass=M, stiffness=K, nodes=nodes)

    def check(self, node: str, key: str) -> None:
        """Refuse a node that the body does not have."""
        if node not in self.nodes:
            raise InputError(key, node, f"must be one of {', '.join(sorted(self.nodes))}")

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.stiffness)

    def with_coordinates(self, nodes: tuple[str, ...]) -> tuple[Condensed, tuple[tuple[int, int], ...]]:
        """Transform the body so that its first coordinates are the motions of ``nodes``.

        Also returns these motions as (index of the node, direction).

        Raises
        ------
        InputError
            If the motions are not independent because there are too few modes.
        """
        if not nodes:
            return self, ()
        joined = [(k, d, row) for k, node in enumerate(nodes) for d, row in enumerate(self.nodes[node]) if row.any()]
        rows = np.array([row for *_, row in joined])
        scaled = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        _, values, vectors = np.linalg.svd(scaled)
        if len(rows) > self.size or values[-1] < 1e-9:
            allowed = f"must have modes enough for {len(rows)} independent motions of the joined nodes"
            raise InputError("frequency", f"{self.size} coordinates", allowed)
        back = np.linalg.inv(np.concatenate([rows, vectors[len(rows) :]]))
        changed = Condensed(
            mass=back.T @ self.mass @ back,
            stiffness=back.T @ self.stiffness @ back,
            nodes={node: R @ back for node, R in self.nodes.items()},
        )
        return changed, tuple((k, d) for k, d, _ in joined)


def _bounded(name: str, A: NDArray) -> NDArray:
    """Return a matrix; refuse numbers that are not finite or larger than ``LARGEST``."""
    if not np.isfinite(A).all():
        raise InputError(name, "not finite", "must be finite numbers")
    if np.abs(A).max(initial=0.0) > LARGEST:
        raise InputError(name, float(np.abs(A).max()), f"must be at most {LARGEST:g}")
    return A


def _checked(name: str, A: NDArray) -> NDArray:
    """Symmetric part of a matrix; refuse one that is not symmetric and positive semidefinite up to rounding."""
    largest = np.abs(_bounded(name, A)).max(initial=0.0)
    if np.abs(A - A.T).max(initial=0.0) > ROUNDED * largest:
        raise InputError(name, "not symmetric", "must be symmetric")
    d = np.sqrt(np.maximum(np.abs(np.diag(A)), 1e-12 * largest))
    if largest and np.linalg.eigvalsh((A + A.T) / 2 / d[:, None] / d)[0] < -ROUNDED * len(A):
        raise InputError(name, "a negative eigenvalue", "must have no negative eigenvalue")
    return (A + A.T) / 2
