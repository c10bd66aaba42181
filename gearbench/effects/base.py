"""Base classes of the two kinds of effects, compliance and gap. Contributions of the same kind add up.

Contact lines are cut into short segments. Contributions are arrays (position, pair, segment): position in the mesh
cycle, tooth pair, segment of its contact line. Lengths are in mm and forces in N, normal to the flank. A positive gap
means missing material.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.pair import Pair
from gearbench.geometry.profile import Modification
from gearbench.lazy import xr

if TYPE_CHECKING:
    from gearbench.compliance.flank import FlankCompliance


@dataclass(frozen=True, kw_only=True)
class LowRank:
    """Smooth compliance H = Ψ Ψᵀ [mm/N] of the segments.

    Parameters
    ----------
    factor
        Ψ, (position, pair, segment, rank) [√(mm/N)].
    coupled
        False: the tooth pairs deflect independently. True: a force on one tooth deflects the others too, because all
        pairs share the columns of Ψ.
    """

    factor: NDArray
    coupled: bool = False


@dataclass(frozen=True, kw_only=True)
class Dense:
    """Symmetric compliance H [mm/N] between all segments of a position.

    Parameters
    ----------
    matrix
        H (position, pair·segment, pair·segment); rows and columns of tooth pairs without a contact line are ignored.
    positive
        Whether the matrix is known to have no negative eigenvalues; otherwise they are removed.
    """

    matrix: NDArray
    positive: bool = False


@dataclass(frozen=True, kw_only=True)
class FlankPair:
    """Smooth compliance of the flanks of pinion and wheel, for any contact lines.

    Parameters
    ----------
    both
        Compliance of each flank.
    coupled
        Whether a force on one tooth of a gear deflects its other teeth.
    """

    both: tuple[FlankCompliance, FlankCompliance]
    coupled: bool = False

    def on(self, lines: ContactLines) -> LowRank | Dense:
        """Compliance of the segments of ``lines``."""
        from gearbench.compliance.flank import flank_factor
        from gearbench.compliance.over_phases import matrix_at_phases

        if self.coupled:
            return Dense(matrix=matrix_at_phases(self.both, lines), positive=True)
        return LowRank(factor=flank_factor(self.both, lines))


@dataclass(frozen=True, kw_only=True)
class LineLaw:
    """Local compression g = q (a − h ln q) [mm] of a segment of length ℓ under its line load q = P/ℓ [N/mm].

    Parameters
    ----------
    a, h
        Coefficients (position, pair, segment) [mm²/N]; with h = 0 the law is linear.
    """

    a: NDArray
    h: NDArray

    @classmethod
    def total(cls, laws: Iterable[LineLaw], shape: tuple[int, ...]) -> LineLaw:
        """Sum of ``laws`` on segments (position, pair, segment) of this ``shape``; zero without laws."""
        laws, zeros = tuple(laws), np.zeros(shape)
        return cls(a=sum((law.a for law in laws), zeros), h=sum((law.h for law in laws), zeros))


@dataclass(frozen=True)
class Effect(ABC):
    """One physical effect, with the keys of its table in the scene."""

    #: Name of the table below ``[effects]``.
    name: ClassVar[str]
    #: One line for ``gearbench plan`` and the documentation: the term that the effect adds.
    summary: ClassVar[str]
    #: Source of the model.
    source: ClassVar[str]
    #: One line for the documentation: when to use it.
    use: ClassVar[str] = ""
    #: Example of the table, for the documentation.
    example: ClassVar[dict[str, Any]] = {}
    #: Names of effects that this one requires, with the reason.
    requires: ClassVar[dict[str, str]] = {}
    #: Names of effects that this one excludes, with the reason.
    conflicts: ClassVar[dict[str, str]] = {}

    def check(self, pair: Pair, effects: Effects) -> None:  # noqa: B027
        """Check that the keys fit the pair and the other effects of the scene.

        Raises
        ------
        InputError
            If a key does not fit; the error names the key relative to the effect's table.
        """

    def kept(self) -> dict[str, xr.DataArray]:
        """Contents of the effect's files as variables to store in a Dataset; none by default.

        The names of the variables begin with the name of the effect and "_".
        """
        return {}

    @classmethod  # noqa: B027
    def recall(cls, kept: Mapping[str, xr.DataArray]) -> None:
        """Register the variables that ``kept`` stored in a Dataset, so that scenes do not need the files.

        Raises
        ------
        InputError
            If a variable does not have the form that ``kept`` gives it.
        """


#: Effects of a scene by name; never changed.
Effects: TypeAlias = Mapping[str, Effect]


def refuse_foreign_keys(effect: Effect, owners: Mapping[str, tuple[str, ...]]) -> None:
    """Refuse keys of models other than ``effect.model``, unless they have their default value.

    Parameters
    ----------
    effect
        Effect with the field ``model``.
    owners
        The models that use a key, for each key that only some models use.

    Raises
    ------
    InputError
        The message names the key.
    """
    values = {field.name: (getattr(effect, field.name), field.default) for field in fields(effect)}
    for key, models in owners.items():
        given, default = values[key]
        if values["model"][0] not in models and given != default:
            shown = list(given) if isinstance(given, tuple) else given
            raise InputError(key, shown, "belongs to model = " + " or ".join(f'"{model}"' for model in models))


@dataclass(frozen=True)
class ComplianceEffect(Effect):
    """An effect that adds compliance."""

    @abstractmethod
    def compliance(self, lines: ContactLines, effects: Effects) -> LowRank | Dense | LineLaw:
        """Compliance of the segments of ``lines``; ``effects`` are all effects of the scene, including this one."""

    def flank_compliances(self, lines: ContactLines, effects: Effects) -> FlankPair | None:
        """Compliances of both flanks, independent of contact lines; None (the default) if the effect has no such form.

        Compliances of teeth and bodies are summed in this form, before they are evaluated on the lines.
        """
        return None


@dataclass(frozen=True)
class ToothCompliance(ComplianceEffect):
    """An effect that adds smooth compliance to a tooth, spread over the whole flank."""

    @abstractmethod
    def tooth_factor(self, pair: Pair, index: int, height: NDArray, y: NDArray, effects: Effects) -> NDArray:
        """Ψ (…, rank) [√(mm/N)] of a single tooth of gear ``index``.

        A unit normal force at point b of the flank deflects point a by Ψ(a)·Ψ(b). Points are given by the ``height``
        R − r_f above the root circle and the position ``y`` along the face width [mm].
        """

    def both_teeth(self, lines: ContactLines, effects: Effects) -> LowRank:
        """Factors of the teeth of pinion and wheel, concatenated along the rank, (position, pair, segment, rank)."""
        heights = [radius - gear.root_radius for gear, radius in zip(lines.pair.gears, lines.radii, strict=True)]
        parts = [self.tooth_factor(lines.pair, index, heights[index], lines.gear_y(index), effects) for index in (0, 1)]
        return LowRank(factor=np.concatenate(parts, axis=-1))


@dataclass(frozen=True, kw_only=True, eq=False)
class GapOverCycles:
    """Gap that changes from one mesh cycle of a revolution to the next: Σ ``amounts`` (cycle, m) · ``modes`` (…, m).

    Parameters
    ----------
    modes
        Gaps (position, pair, segment, mode) [mm].
    amounts
        Multiples of the modes in each mesh cycle (cycle, mode) [–].
    """

    modes: NDArray
    amounts: NDArray


@dataclass(frozen=True)
class GapEffect(Effect):
    """An effect that adds gap."""

    #: Whether the effect describes the shape of a flank, so that drive and coast flanks may differ.
    of_flank: ClassVar[bool] = True

    @abstractmethod
    def gap(self, lines: ContactLines) -> NDArray:
        """Initial gap e normal to the flank, (position, pair, segment) [mm]."""

    def modifications(self, pair: Pair) -> tuple[Modification, ...]:
        """The gap as profile modifications, if it does not vary over the face; none by default."""
        return ()

    def kinks(self, pair: Pair) -> tuple[float, ...]:
        """Positions u [mm] on the path of contact where the gap has a kink; none by default."""
        return ()

    def face_kinks(self, pair: Pair) -> tuple[float, ...]:
        """Positions y [mm] along the face where the gap has a kink; none by default."""
        return ()

    def turning(self, lines: ContactLines, cycles: NDArray) -> GapOverCycles | None:
        """The gap in mesh cycles with the numbers ``cycles`` (cycle,), if it changes between them; None by default."""
        return None

    def later(self, pair: Pair, cycles: tuple[int, int]) -> GapEffect:
        """The effect if teeth of pinion and wheel are counted from ``cycles`` teeth later; unchanged by default.

        The result has the same modes in ``turning``.
        """
        return self


@dataclass(frozen=True)
class ChangingGap(GapEffect):
    """A gap that changes from one mesh cycle to the next."""

    @abstractmethod
    def turning(self, lines: ContactLines, cycles: NDArray) -> GapOverCycles:
        """The gap in the mesh cycles with the numbers ``cycles`` (cycle,)."""

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap of the mesh cycle 0, (position, pair, segment) [mm]."""
        gaps = self.turning(lines, np.zeros(1, dtype=int))
        return gaps.modes @ gaps.amounts[0]
