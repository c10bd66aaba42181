"""Settings that determine the numerical error of a simulation: names, levels, and how to change them.

A setting never changes the model: a plate stays a plate, a solid stays a solid. The accuracy control changes the order
of the Ritz functions only if the scene leaves it open, as it may for the solid tooth. ``gearbench cost`` measures the
work–precision of every registered setting.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from gearbench.effects.teeth import solid_order
from gearbench.effects.tooth_bending import tooth_bending
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import scene_at

#: Level of a setting: a whole number, a tolerance, numbers of functions per direction, or the name of a basis.
Level = int | float | tuple[int, ...] | str


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Numerical setting with its levels, coarse to fine.

    Parameters
    ----------
    name
        Name in tables and figures.
    levels
        Function that gives the levels for a scene, coarse to fine; none if the setting does not apply.
    with_level
        Function that sets a scene to a level.
    order
        Order p of convergence, error ~ size^−p, as text.
    size
        Function that gives the size n of a level.
    prepares
        Whether the setting affects parts that are computed once per pair.
    limit
        Function that gives two scenes close to the limit of the setting: the second finest and the finest. By default
        they are at the two finest levels, which then are not measured.
    """

    name: str
    levels: Callable[[Scene], tuple[Any, ...]]
    with_level: Callable[[Scene, Any], Scene]
    order: str
    size: Callable[[Any], float] = float
    prepares: bool = False
    limit: Callable[[Scene], tuple[Scene, Scene]] | None = None

    def applies(self, scene: Scene) -> bool:
        """Whether the scene has this setting."""
        return len(self.levels(scene)) > 0

    def tried(self, scene: Scene) -> tuple[Any, ...]:
        """Levels at which the error is measured."""
        return self.levels(scene)[: None if self.limit else -2]

    def finest(self, scene: Scene) -> tuple[Scene, Scene]:
        """Scenes of the error bar and of the reference: at the second finest and the finest level."""
        if self.limit is not None:
            return self.limit(scene)
        before, exact = (self.with_level(scene, level) for level in self.levels(scene)[-2:])
        return before, exact


def label(level: Level) -> str:
    """Level as text: 16, 5 × 7 × 12, 0.01, paper."""
    if isinstance(level, str):
        return level
    return " × ".join(str(n) for n in level) if isinstance(level, tuple) else f"{level:g}"


def with_resolution(
    scene: Scene, *, segments: int | None = None, gauss_points: int | None = None, positions: int | None = None
) -> Scene:
    """Return ``scene`` with a changed resolution; uniform positions and Gauss points exclude each other."""
    old = scene.resolution
    if positions is None and gauss_points is None:
        positions, gauss_points = old.positions, old.gauss_points
    new = Resolution(segments=segments or old.segments, gauss_points=gauss_points, positions=positions)
    return replace(scene, resolution=new)


def with_effect(scene: Scene, name: str, **changes: object) -> Scene:
    """Return ``scene`` with changed keys of an effect; in a train, of the effect of all meshes."""
    if scene.train is not None:
        return scene_at(scene, {f"effects.{name}.{key}": value for key, value in changes.items()})
    effects = [replace(effect, **changes) if effect.name == name else effect for effect in scene.effects]
    return replace(scene, effects=tuple(effects))


def with_order(scene: Scene, order: Level) -> Scene:
    """Return ``scene`` with ``order`` for its solid teeth."""
    return with_effect(scene, "tooth_bending", order=order)


#: Ladder of solid orders: functions across the thickness, functions along the height, and factor and addend on the
#: default number along the axis. The height matters most, because the stress is singular where the flank meets the
#: clamped root; on narrow helical gears the axis matters as much.
_SOLID = (
    (3, 4, 0.8, 0),
    (4, 5, 0.9, 0),
    (6, 7, 1.0, 0),
    (8, 10, 1.0, 2),
    (9, 14, 1.1, 4),
    (10, 20, 1.2, 4),
    (11, 28, 1.3, 4),
    (12, 36, 1.4, 5),
    (13, 40, 1.4, 5),
)


def solid_orders(scene: Scene) -> tuple[tuple[int, int, int], ...]:
    """Orders of solid teeth around the default, coarse to fine; none if the scene gives the order."""
    solid = tooth_bending(scene.effects_by_name, "solid")
    if solid is None or solid.order is not None:
        return ()
    axis = max(solid_order(gear)[2] for gear in scene.pair.gears)
    return tuple((s, h, min(40, max(2, round(factor * axis) + more))) for s, h, factor, more in _SOLID)


SEGMENTS = Setting(
    name="segments",
    levels=lambda _: (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024),
    with_level=lambda scene, level: with_resolution(scene, segments=level),
    order="exponential; 2, of k 1, where flanks part",
)
GAUSS_POINTS = Setting(
    name="gauss_points",
    levels=lambda _: (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 48, 64, 96),
    with_level=lambda scene, level: with_resolution(scene, gauss_points=level),
    order="exponential; less where a pair takes its load",
)
POSITIONS = Setting(
    name="positions",
    levels=lambda _: (6, 11, 22, 45, 90, 180, 360, 720),
    with_level=lambda scene, level: with_resolution(scene, positions=level),
    order="1, the stiffness jumps",
    limit=GAUSS_POINTS.finest,  # both converge to the same integral
)


def _plate_orders(scene: Scene) -> tuple[Level, ...]:
    if tooth_bending(scene.effects_by_name, "plate") is None:
        return ()
    return ((1, 1), "paper", *((p, p) for p in (2, 3, 4, 5, 6, 8, 10, 14, 20)))


def _with_plate_order(scene: Scene, level: Any) -> Scene:
    if level == "paper":
        return with_effect(scene, "tooth_bending", basis="paper", order=None)
    return with_effect(scene, "tooth_bending", basis=None, order=level)


#: The accuracy control never changes the order of the plate, because the basis belongs to the model.
PLATE_ORDER = Setting(
    name="plate order",
    levels=_plate_orders,
    with_level=_with_plate_order,
    order="algebraic: loads on lines are singular",
    size=lambda level: 1.5 if level == "paper" else level[0],
    prepares=True,
)
SOLID_ORDER = Setting(
    name="solid order",
    levels=solid_orders,
    with_level=with_order,
    order="2, the root is singular",
    size=lambda level: level[1],
    prepares=True,
)
#: Settings of a single simulation by name, whose work–precision is measured.
SETTINGS = {setting.name: setting for setting in (SEGMENTS, GAUSS_POINTS, POSITIONS, PLATE_ORDER, SOLID_ORDER)}
