"""Random manufacturing errors of both gears and of their axes, drawn by ``gearbench.robustness``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass as plain_dataclass
from dataclasses import replace
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.effects.base import Effects, GapEffect
from gearbench.effects.distributions import DISTRIBUTIONS, Distribution
from gearbench.effects.expansion import ErrorModes, Expansion
from gearbench.effects.shape import MICROMETRE, Along, Gears, Shape, Span, barrel, chosen, face_slope, opening, slope
from gearbench.effects.varied import Eccentricity, PitchKind, RandomVariable, RunOut, SizeScatter, VariedKey
from gearbench.errors import InputError, naming
from gearbench.geometry.action import ContactLines, pair_indices
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.schema import STRICT
from gearbench.tolerances import Edition, FlankTolerances, gear_tolerances, shaft_parallelism

Tolerance = Literal[
    "profile_slope",
    "profile_form",
    "profile_total",
    "helix_slope",
    "helix_form",
    "helix_total",
    "inclination",
    "deviation",
]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ErrorKind:
    """One kind of error: its amplitude and distribution.

    Parameters
    ----------
    distribution
        Distribution in units of the amplitude f; see ``gearbench.effects.distributions``.
    amplitude
        f [µm]; by default the tolerance of the ISO class.
    tolerance
        Tolerance of the class to use as amplitude; by default the tolerance with the name of the error.
    gear
        Gears that have the error, drawn independently. Ignored for the axes.
    drawn
        "gear": the error is the same on all teeth. "tooth": it is independent for every tooth. Ignored for the axes.
    sign
        −1 for excess material instead of missing material (a hollow instead of a barrel).
    cost
        Relative cost of a tolerance one class finer; ``robust`` uses it to say which tolerance to tighten first.
    """

    distribution: Distribution = "uniform"
    amplitude: Annotated[float, Field(ge=0.0, le=1000.0)] | None = None
    tolerance: Tolerance | None = None
    gear: Gears = "both"
    drawn: Literal["gear", "tooth"] = "gear"
    sign: Literal[-1, 1] = 1
    cost: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0


IsoClass = Annotated[int, Field(ge=0, le=12)]


@plain_dataclass(frozen=True)
class ErrorMode:
    """One random error of the pair.

    Parameters
    ----------
    name
        Name of the error.
    amplitude
        Amplitude f [µm].
    distribution
        Distribution in units of f.
    sign
        −1 for excess material.
    shape
        Function that gives the gap of 1 µm on contact lines [mm].
    tooth
        Number of the tooth pair that has the error; None for all.
    cost
        Relative cost of a tolerance one class finer.
    """

    name: str
    amplitude: float
    distribution: Distribution
    sign: int
    shape: Callable[[ContactLines], NDArray]
    tooth: int | None
    cost: float

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap of 1 µm of the error, (position, pair, segment) [mm]."""
        gap = self.sign * self.shape(lines)
        return gap if self.tooth is None else gap * (lines.index == self.tooth)[:, None]


#: Keys of errors with one shape on the flank, keys of ISO classes, and errors of the axes.
_SHAPES = ("profile_slope", "profile_form", "helix_slope", "helix_form", "inclination", "deviation")
_CLASSES = ("iso_class", "pinion_iso_class", "wheel_iso_class")
_OF_AXES = ("inclination", "deviation")
#: Shape over the face of the wave of run-out and of wobble.
_REVOLVING: MappingProxyType[str, Any] = MappingProxyType({"run_out": "even", "wobble": "tilting"})
#: Keys of errors that are not an ``ErrorKind``.
_OTHERS = (*_REVOLVING, "varied", "centre_distance", "tooth_thickness")
#: Number of equally probable centre distances at which samples are solved, so that few pairs have to be assembled.
DISTANCES = 16


@dataclass(frozen=True, kw_only=True, config=STRICT)
class ManufacturingErrors(GapEffect):
    """Random errors of profile, helix and axes. A kind of error is drawn if its table is given.

    ``robust`` draws the errors; ``simulate`` takes every error at its mean. Errors of different gears and kinds are
    independent. In planetary sets and parallel paths only profile, helix and pitch errors are drawn, once for each
    flank: the sun, or the ring, has the same errors at all planets, and a planet has different errors at sun and ring.
    Errors of single teeth are independent in each mesh. There "pinion" means the driver of each mesh.

    Parameters
    ----------
    preset
        Published convention; replaces all other keys.
    iso_class, edition, rounded
        Class and edition of ISO 1328-1, and whether tolerances are rounded, for amplitudes that are not given.
        Parallelism of the axes follows ISO/TR 10064-3.
    pinion_iso_class, wheel_iso_class
        Class of one gear; replaces ``iso_class``.
    along
        Coordinate of profile errors: "roll" length or "radius".
    profile_range
        Span of profile errors: the "active" profile, the "involute" from form circle to tip, or the whole "tooth".
    profile_slope, profile_form, helix_slope, helix_form
        f_Hα, f_fα, f_Hβ, f_fβ of each gear.
    inclination, deviation
        f_Σδ, f_Σβ of the axes.
    single_pitch
        f_pt of each gear: an index deviation for every tooth in contact.
    run_out, wobble
        F_r of each gear at a random phase: a wave of order 1 (F7 of docs/theory.md). Run-out is the same all over the
        face, wobble tilts.
    varied
        Numbers of other gap effects that vary, one table each.
    centre_distance
        Variation of the centre distance. Every sample is solved at one of 16 equally probable centre distances.
    tooth_thickness
        Variation of the tooth thickness of both gears, which gives the backlash of every sample.
    """

    preset: Literal["garambois2017"] | None = None
    iso_class: IsoClass | None = None
    pinion_iso_class: IsoClass | None = None
    wheel_iso_class: IsoClass | None = None
    edition: Edition = "2013"
    rounded: bool = False
    along: Along = "roll"
    profile_range: Span = "active"
    profile_slope: ErrorKind | None = None
    profile_form: ErrorKind | None = None
    helix_slope: ErrorKind | None = None
    helix_form: ErrorKind | None = None
    inclination: ErrorKind | None = None
    deviation: ErrorKind | None = None
    single_pitch: PitchKind | None = None
    run_out: RunOut | None = None
    wobble: RunOut | None = None
    varied: Annotated[tuple[VariedKey, ...], Field(max_length=100)] = ()
    centre_distance: SizeScatter | None = None
    tooth_thickness: SizeScatter | None = None

    of_flank: ClassVar[bool] = False
    name: ClassVar[str] = "manufacturing_errors"
    summary: ClassVar[str] = "gap: random errors of profile, helix and axes"
    source: ClassVar[str] = "ISO 1328-1, ISO/TR 10064-3; Garambois et al. 2017"
    use: ClassVar[str] = "For `gearbench robust`: errors within a tolerance class."
    example: ClassVar[dict[str, Any]] = {"preset": "garambois2017"}

    def __post_init__(self) -> None:
        kinds = [name for name in (*_SHAPES, "single_pitch") if getattr(self, name) is not None]
        others = [name for name in _OTHERS if getattr(self, name)]
        if self.preset is not None:
            classes = [name for name in _CLASSES if getattr(self, name) is not None]
            if clashes := [*kinds, *others, *classes]:
                clash = clashes[0]
                raise InputError(clash, "given", f'conflicts with preset = "{self.preset}": give one of the two')
            return
        if not kinds and not others:
            every = ", ".join((*_SHAPES, "single_pitch", *_OTHERS))
            raise InputError("", "no kind of error", f"give preset, or at least one table of {every}")
        keys = [each.key for each in self.varied]
        for key in keys:
            if keys.count(key) > 1:
                raise InputError("varied", key, "given twice: each key at most once")
        for name in kinds:
            if getattr(self, name).amplitude is None and None in map(self.class_of, (0, 1)):
                raise InputError(f"{name}.amplitude", "missing", "is required where iso_class is not given")

    def class_of(self, index: int) -> int | None:
        """ISO class of a gear."""
        gear_class = (self.pinion_iso_class, self.wheel_iso_class)[index]
        return self.iso_class if gear_class is None else gear_class

    def check(self, pair: Pair, effects: Effects) -> None:
        """Refuse a class or gears outside the scope of the standard, and impossible variations."""
        self.variables(pair)
        for i, each in enumerate(self.varied):
            with naming(below=f"varied.{i}"):
                each.check(pair, effects)

    def convention(self) -> ManufacturingErrors:
        """These errors, or the errors of the preset."""
        return PRESETS[self.preset] if self.preset is not None else self

    @lru_cache(maxsize=64)  # noqa: B019 - a few small objects, asked for at every gap of a scene
    def error_modes(self, pair: Pair) -> tuple[ErrorMode, ...]:
        """Errors of profile, helix, axes and pitch, in a fixed order."""
        convention = self.convention()
        modes = []
        for name in _SHAPES:
            kind: ErrorKind | None = getattr(convention, name)
            if kind is None:
                continue
            gears = (0,) if name in _OF_AXES else chosen(kind.gear)
            for gear in gears:
                amplitude = kind.amplitude
                if amplitude is None:
                    amplitude = convention.class_amplitude(kind.tolerance or name, pair, gear)
                shape = convention._shape(name, pair, gear)
                label = name if name in _OF_AXES else f"{name}_{GEARS[gear]}"
                teeth = (None,) if kind.drawn == "gear" or name in _OF_AXES else tuple(pair_indices(pair).tolist())
                for tooth in teeth:
                    full = label if tooth is None else f"{label}_tooth{tooth:+d}"
                    modes.append(ErrorMode(full, amplitude, kind.distribution, kind.sign, shape, tooth, kind.cost))
        return (*modes, *self._of_pitch(pair))

    def _of_pitch(self, pair: Pair) -> Iterator[ErrorMode]:
        """Index deviations of the teeth in contact and of those next to them."""
        if (kind := self.single_pitch) is None:
            return
        in_contact = pair_indices(pair).tolist()
        for gear in chosen(kind.gear):
            f = self.class_amplitude("single_pitch", pair, gear) if kind.amplitude is None else kind.amplitude
            for tooth in (in_contact[0] - 1, *in_contact, in_contact[-1] + 1):
                name = f"single_pitch_{GEARS[gear]}_tooth{tooth:+d}"
                yield ErrorMode(name, f / 2, kind.distribution, 1, partial(_index_deviation, gear), tooth, kind.cost)

    def class_amplitude(self, tolerance: str, pair: Pair, index: int) -> float:
        """Tolerance [µm] of the ISO class of gear ``index``."""
        if tolerance not in _OF_AXES:
            return getattr(self._flank(pair, index), tolerance)
        largest = max(self._flank(pair, i).helix_total for i in (0, 1))
        return getattr(shaft_parallelism(largest, pair.meshing.face_width), tolerance)

    def _flank(self, pair: Pair, index: int) -> FlankTolerances:
        # class 0 stands for a missing class, which is refused unless amplitudes are given
        return gear_tolerances(pair.gears[index], self.class_of(index) or 0, self.edition, self.rounded)

    def modes(self, lines: ContactLines) -> NDArray:
        """Gap of 1 µm of each error, (position, pair, segment, error) [mm]."""
        return np.stack([mode.gap(lines) for mode in self.error_modes(lines.pair)], axis=-1)

    def _revolving(self) -> tuple[Eccentricity, ...]:
        """Run-out and wobble of each gear that has them."""
        eccentricities = []
        for name, over_face in _REVOLVING.items():
            if (kind := getattr(self, name)) is not None:
                for gear in chosen(kind.gear):
                    eccentricities.append(Eccentricity(name, gear, kind.amplitude, kind.distribution, over_face))
        return tuple(eccentricities)

    def _of_sizes(self, pair: Pair) -> tuple[RandomVariable, ...]:
        """Random variables of centre distance and tooth thickness."""
        variables = []
        if self.centre_distance is not None:
            ends = (pair.centre_distance_lower, pair.centre_distance_upper)
            variables.append(self.centre_distance.variable("centre_distance", ends))
        if self.tooth_thickness is not None:
            for index, member in enumerate(pair.members):
                ends = (0.0, 0.0) if member.thickness is None else (member.thickness.lower, member.thickness.upper)
                variables.append(self.tooth_thickness.variable(f"tooth_thickness_{GEARS[index]}", ends))
        return tuple(variables)

    def variables(self, pair: Pair) -> tuple[ErrorMode | RandomVariable, ...]:
        """All random variables: ``error_modes``, run-out and wobble, numbers of other effects, sizes.

        Sizes are the centre distance and the tooth thicknesses.
        """
        revolving = (variable for each in self._revolving() for variable in each.variables)
        varied = (RandomVariable(each.key, each.amplitude, each.distribution) for each in self.varied)
        return (*self.error_modes(pair), *revolving, *varied, *self._of_sizes(pair))

    def mean(self, pair: Pair) -> NDArray:
        """Mean of each random variable, (error,) [µm]; 0 for numbers of other effects and for sizes."""
        return np.array([v.amplitude * DISTRIBUTIONS[v.distribution].mean for v in self.variables(pair)])

    def draw(self, unit: NDArray, pair: Pair) -> NDArray:
        """Errors (sample, error) [µm, or the unit of the key] from uniform numbers in (0, 1) of the same shape."""
        columns = []
        for i, v in enumerate(self.variables(pair)):
            drawn = unit[:, i]
            if v.name == "centre_distance":
                drawn = (np.floor(drawn * DISTANCES) + 0.5) / DISTANCES
            columns.append(v.amplitude * DISTRIBUTIONS[v.distribution].quantile(drawn))
        return np.stack(columns, axis=-1)

    def expansion(self, lines: ContactLines, effects: Effects) -> Expansion:
        """Gaps of samples on ``lines`` as sums of modes; ``effects`` are the effects of the loaded flank."""
        column, parts = len(self.error_modes(lines.pair)), []
        if column:
            parts.append(ErrorModes(columns=slice(0, column), modes=self.modes(lines), amounts=lambda values: values))
        for each in self._revolving():
            parts.append(ErrorModes(columns=slice(column, column + 2), modes=each.modes(lines), amounts=each.amounts))
            column += 2
        for key in self.varied:
            modes = key.modes(lines, effects)
            amounts = partial(key.amounts, modes.shape[-1])
            parts.append(ErrorModes(columns=slice(column, column + 1), modes=modes, amounts=amounts))
            column += 1
        if not parts:  # centre distance and tooth thickness do not change the gap
            no_gap = np.zeros((*lines.shape, 1))
            parts.append(ErrorModes(columns=slice(0, 1), modes=no_gap, amounts=np.zeros_like))
        return Expansion(parts=tuple(parts), mean=self.mean(lines.pair))

    def gap(self, lines: ContactLines) -> NDArray:
        """Gap with every error at its mean, (position, pair, segment) [mm]."""
        # not strict: the means of further variables follow
        with_means = zip(self.error_modes(lines.pair), self.mean(lines.pair), strict=False)
        total = sum((mean * mode.gap(lines) for mode, mean in with_means if mean), np.zeros(lines.shape))
        for each in self._revolving():
            total = total + each.modes(lines)[..., 0] * each.amplitude * DISTRIBUTIONS[each.distribution].mean
        return total

    def _shape(self, name: str, pair: Pair, index: int) -> Callable[[ContactLines], NDArray]:
        """Function for the gap of 1 µm of an error: opening of the axes, or a slope or barrel on a flank.

        Slopes and barrels are 0 in the middle of the flank, near the place where the pitch is measured. A mean gap
        would be a pitch error, which changes how the planets of a set share the load.
        """
        if name in _OF_AXES:
            return partial(opening, **({"inclination": 0.0, "deviation": 0.0} | {name: 1.0}))
        profile = name.startswith("profile")
        ramp = slope(pair, index, self.along, self.profile_range) if profile else face_slope(pair, index)
        centred = replace(ramp, start=ramp.start + ramp.length / 2)
        return Shape(gear=index, factors=(barrel(ramp) if name.endswith("form") else centred,)).gap


def _index_deviation(index: int, lines: ContactLines) -> NDArray:
    """Gap of an index deviation of 1 µm along the pitch circle of gear ``index``, (position, pair, segment) [mm]."""
    gear = lines.pair.gears[0]
    return np.full(lines.shape, MICROMETRE * np.cos(gear.alpha_t) * np.cos(gear.beta_b)) * lines.levers[index]


#: Conventions by name; ``studies/s01_table2`` derives "garambois2017".
PRESETS: MappingProxyType[str, ManufacturingErrors] = MappingProxyType(
    {
        "garambois2017": ManufacturingErrors(
            iso_class=6,
            edition="1995",
            along="radius",
            profile_slope=ErrorKind(distribution="uniform_two_sided", tolerance="profile_form"),
            profile_form=ErrorKind(distribution="normal", tolerance="profile_slope"),
            helix_form=ErrorKind(distribution="normal"),
            inclination=ErrorKind(distribution="normal_two_sided"),
            deviation=ErrorKind(distribution="normal_two_sided"),
        )
    }
)
