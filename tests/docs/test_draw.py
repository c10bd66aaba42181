"""Figures of the documentation that are drawn from effects show all of them."""

from docs.draw_flanks import SHAPES
from gearbench.effects.registry import EFFECTS, effect_class


def test_every_shape_of_a_flank_has_a_picture():
    """What adds gap, but random errors, and what changes from tooth to tooth, which has a figure of its own."""
    shapes = {name for name in EFFECTS if effect_class(name).summary.startswith("gap: ")}
    drawn = {name for name, _ in SHAPES.values()} | {"manufacturing_errors", "waviness"}
    drawn |= {"pitch_errors", "random_pitch"}
    assert drawn | {"off_line_contact"} == shapes
