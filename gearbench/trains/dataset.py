"""Dataset of a train whose meshes form one contact problem."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearbench.results.cycle import MICROMETRES, CycleCurve, coefficients
from gearbench.results.outputs import curve_floor
from gearbench.results.points import Columns, Point, join_points
from gearbench.results.responses import is_of_train, response
from gearbench.results.train_cycle import USUAL_OF_TRAIN
from gearbench.solution import columns
from gearbench.trains.revolution import revolution_columns
from gearbench.trains.solve import SolvedTrain

#: Curves that exist only while a mesh has contact; names of the numbers derived from them begin with these names.
CURVES = ("transmission_error", "mesh_stiffness")


def _of_loaded(variables: Columns, loaded: NDArray) -> Columns:
    """Set δ and k to NaN where flanks part; ``loaded`` (mesh, position) tells where a mesh carries load.

    Numbers over the cycle are NaN if flanks part at any position.
    """
    masked = dict(variables)
    for name, (dims, values) in variables.items():
        if name.startswith(CURVES):
            is_loaded = loaded if "position" in dims else loaded.all(axis=1)
            masked[name] = (
                dims,
                np.where(is_loaded.reshape(is_loaded.shape + (1,) * (values.ndim - is_loaded.ndim)), values, np.nan),
            )
    return masked


def train_point(solved: SolvedTrain, outputs: Sequence[str]) -> Point:
    """Result of a ``coupled`` scene: the ``outputs`` of each mesh, and the quantities of the whole train.

    Positions are the phases of the first mesh.
    """
    of_train = [name for name in outputs if is_of_train(name)]
    of_mesh = [name for name in outputs if name not in of_train]
    meshes = join_points([Point(*columns(mesh, of_mesh)) for mesh in solved.meshes.values()], "mesh")
    linkage, balance, phases = solved.linkage, solved.balance, solved.phases
    coords, variables = dict(meshes.coords), _of_loaded(meshes.variables, balance.force.T > 0)
    shift = linkage.train.phases(coast=linkage.coast)
    coords |= {"mesh": (("mesh",), np.array(list(solved.meshes)))}
    coords["phase_shift"] = (("mesh",), np.array([shift[name] for name in solved.meshes]))
    coords["harmonic"] = ("harmonic",), np.array(phases.orders)
    coords["member"], coords["axis"] = (("member",), np.array(linkage.bodies)), (("axis",), np.array(["x", "y"]))
    force, sharing = balance.force.T, balance.force.T / solved.even[:, None]
    variables |= {
        "mesh_load": (("mesh", "position"), force),
        "load_sharing": (("mesh", "position"), sharing),
    }
    cycle = solved.cycle
    error, amplitude = cycle.transmission_error, coefficients(phases, cycle.transmission_error)
    curve = CycleCurve(phases=phases, values=error)
    floor = curve_floor(list(solved.meshes.values()), curve, solved.change)
    variables |= {
        "train_transmission_error": (("position",), error),
        "train_transmission_error_amplitude": (("harmonic",), 2 * np.abs(amplitude)),
        "train_transmission_error_phase": (("harmonic",), np.angle(amplitude)),
        "train_transmission_error_amplitude_noise_floor": (("harmonic",), floor),
        "train_transmission_error_peak_to_peak_noise_floor": ((), curve.peak_to_peak_floor(floor)),
        "train_stiffness": (("position",), solved.stiffness),
        "turning_error": (("member", "position"), 1e6 * np.multiply.outer(solved.ratios, cycle.input_turn)),
    }
    variables |= {name: ((), response(name).reduce(cycle)) for name in (*USUAL_OF_TRAIN, *of_train)}
    if more := linkage.additional_motions:
        coords["motion"] = ("motion",), np.array([motion.name for motion in more])
        variables["motion_amount"] = ("motion", "position"), MICROMETRES * balance.motion[:, -len(more) :].T
    loads = np.moveaxis(linkage.on_bodies(balance.force), 0, -1)
    amplitude = 2 * np.abs(coefficients(phases, loads))
    variables |= {
        "member_force": (("member", "axis", "position"), loads[:, :2]),
        "member_force_amplitude": (("member", "axis", "harmonic"), amplitude[:, :2]),
        "member_torque": (("member", "position"), 1e-3 * loads[:, 2]),
        "member_torque_amplitude": (("member", "harmonic"), 1e-3 * amplitude[:, 2]),
    }
    more_coords, over = revolution_columns(solved)
    if over:
        variables["mesh_load_factor"] = (), np.maximum(sharing.max(), over["load_sharing_over_revolution"][1].max())
    return Point(coords | more_coords, variables | over)
