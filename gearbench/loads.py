"""Loads of a pair: one, or several with weights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.schema import STRICT


def _loaded(torque: float) -> float:
    if torque == 0:
        raise InputError("", torque, "must not be 0: positive for drive flanks, negative for coast flanks")
    return torque


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Load:
    """Load of the pair.

    Parameters
    ----------
    torque
        Torque on the pinion [N·m], not 0. Negative: the coast flanks carry the load.
    """

    torque: Annotated[float, AfterValidator(_loaded)]

    @property
    def coast(self) -> bool:
        """Whether the coast flanks carry the load."""
        return self.torque < 0


@dataclass(frozen=True, kw_only=True, config=STRICT)
class DrivingScene:
    """Instead of ``torque``, ``[load]`` takes another scene and its member that drives this one.

    Two planetary sets in a row are two scenes, each with its own mesh cycle (``examples/second_set.toml``). The shaft
    between them passes on the mean torque, but no vibration.

    Parameters
    ----------
    scene
        File of the scene that drives this one, relative to this file.
    member
        Member of that scene whose shaft carries the first driver of this scene, e.g. "carrier".
    """

    scene: str
    member: str


@dataclass(frozen=True, kw_only=True, config=STRICT)
class WeightedLoad:
    """One of several loads of the pair.

    Parameters
    ----------
    torque
        Torque on the pinion [N·m], not 0.
    weight
        Relative weight in means over the loads [–].
    """

    torque: Annotated[float, AfterValidator(_loaded)]
    weight: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0


def greatest_load(loads: Sequence[WeightedLoad]) -> Load:
    """Load with the greatest absolute torque."""
    return Load(torque=max((load.torque for load in loads), key=abs))


def load_weights(loads: Sequence[WeightedLoad]) -> NDArray:
    """Normalised weights of the loads, torques ascending, (load,)."""
    weight = np.array([load.weight for load in sorted(loads, key=lambda load: load.torque)])
    return weight / weight.sum()
