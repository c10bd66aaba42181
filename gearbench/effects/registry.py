"""Every effect by the name of its table; an effect's module is imported when a scene asks for it."""

from __future__ import annotations

from importlib import import_module

from gearbench.effects.base import Effect

#: Table name → module and class. Adding an effect is one file and one line here.
EFFECTS: dict[str, tuple[str, str]] = {
    "tooth_bending": ("gearbench.effects.tooth_bending", "ToothBending"),
    "tooth_foundation": ("gearbench.effects.tooth_foundation", "ToothFoundation"),
    "neighbour_teeth": ("gearbench.effects.neighbour_teeth", "NeighbourTeeth"),
    "fe_compliance": ("gearbench.effects.fe_compliance", "FeCompliance"),
    "off_line_contact": ("gearbench.effects.off_line_contact", "OffLineContact"),
    "hertz": ("gearbench.effects.hertz", "Hertz"),
    "crowning": ("gearbench.effects.crowning", "Crowning"),
    "tip_relief": ("gearbench.effects.tip_relief", "TipRelief"),
    "root_relief": ("gearbench.effects.root_relief", "RootRelief"),
    "end_relief": ("gearbench.effects.end_relief", "EndRelief"),
    "profile_slope": ("gearbench.effects.profile_slope", "ProfileSlope"),
    "helix_slope": ("gearbench.effects.helix_slope", "HelixSlope"),
    "manufacturing_errors": ("gearbench.effects.manufacturing_errors", "ManufacturingErrors"),
    "topography": ("gearbench.effects.topography", "Topography"),
    "pitch_errors": ("gearbench.effects.pitch_errors", "PitchErrors"),
    "misalignment": ("gearbench.effects.misalignment", "Misalignment"),
}


def effect_class(name: str) -> type[Effect]:
    """Class of the effect ``name``.

    Raises
    ------
    KeyError
        If there is no such effect.
    """
    module, attribute = EFFECTS[name]
    return getattr(import_module(module), attribute)
