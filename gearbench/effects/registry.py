"""Effects by the names of their tables; the module of an effect is imported on first use."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points

from gearbench.effects.base import Effect
from gearbench.errors import InputError

#: Table name → module and class, for the effects of gearbench itself.
EFFECTS: dict[str, tuple[str, str]] = {
    "tooth_bending": ("gearbench.effects.tooth_bending", "ToothBending"),
    "gear_body": ("gearbench.effects.gear_body", "GearBody"),
    "off_line_contact": ("gearbench.effects.off_line_contact", "OffLineContact"),
    "hertz": ("gearbench.effects.hertz", "Hertz"),
    "crowning": ("gearbench.effects.crowning", "Crowning"),
    "tip_relief": ("gearbench.effects.tip_relief", "TipRelief"),
    "root_relief": ("gearbench.effects.root_relief", "RootRelief"),
    "end_relief": ("gearbench.effects.end_relief", "EndRelief"),
    "profile_slope": ("gearbench.effects.profile_slope", "ProfileSlope"),
    "profile_crowning": ("gearbench.effects.profile_crowning", "ProfileCrowning"),
    "profile_curve": ("gearbench.effects.profile_curve", "ProfileCurve"),
    "helix_curve": ("gearbench.effects.helix_curve", "HelixCurve"),
    "flank_twist": ("gearbench.effects.flank_twist", "FlankTwist"),
    "helix_slope": ("gearbench.effects.helix_slope", "HelixSlope"),
    "manufacturing_errors": ("gearbench.effects.manufacturing_errors", "ManufacturingErrors"),
    "topography": ("gearbench.effects.topography", "Topography"),
    "pitch_errors": ("gearbench.effects.pitch_errors", "PitchErrors"),
    "random_pitch": ("gearbench.effects.random_pitch", "RandomPitch"),
    "waviness": ("gearbench.effects.waviness", "Waviness"),
    "misalignment": ("gearbench.effects.misalignment", "Misalignment"),
}

#: Tables of earlier versions, and their replacements.
RENAMED: dict[str, str] = {
    "neighbour_teeth": "[effects.gear_body], which takes its order from [effects.tooth_bending]",
    "tooth_foundation": '[effects.gear_body] with coupled = false or model = "sainsot_velex"',
    "fe_compliance": '[effects.tooth_bending] with model = "finite_elements", and [effects.gear_body] for the rim',
}


def effect_names() -> tuple[str, ...]:
    """Names of all effects: first those of gearbench, then those of other packages."""
    return (*EFFECTS, *installed())


@cache
def installed() -> dict[str, EntryPoint]:
    """Effects of other packages, from entry points ``gearbench.effects``; names of gearbench cannot be replaced."""
    return {entry.name: entry for entry in entry_points(group="gearbench.effects") if entry.name not in EFFECTS}


def effect_class(name: str) -> type[Effect]:
    """Class of the effect ``name``.

    Raises
    ------
    KeyError
        If there is no such effect.
    InputError
        If the entry point of another package cannot be imported, or does not name an effect.
    """
    if name in EFFECTS:
        module, attribute = EFFECTS[name]
        return getattr(import_module(module), attribute)
    entry = installed()[name]
    try:
        kind = entry.load()
    except (ImportError, AttributeError) as error:
        raise InputError(f"effects.{name}", entry.value, f"cannot be imported: {error}") from None
    if not (isinstance(kind, type) and issubclass(kind, Effect) and kind.name == name):
        raise InputError(f"effects.{name}", entry.value, f'must be a subclass of Effect with the name "{name}"')
    return kind
