"""Cost of each effect, alone and beside the others, and of the machinery of effects: next to nothing."""

import gc
import math
import time
from dataclasses import replace
from statistics import median

import numpy as np
import pytest

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import total_gap
from gearbench.contact.problem import ContactSolution
from gearbench.contact.scaling import scale_problem
from gearbench.contact.solver import solve
from gearbench.contact.transitions import mesh_phases
from gearbench.effects.base import GapEffect, LineLaw
from gearbench.effects.crowning import Crowning
from gearbench.effects.end_relief import EndRelief
from gearbench.effects.gear_body import GearBody
from gearbench.effects.helix_slope import HelixSlope
from gearbench.effects.hertz import Hertz
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.misalignment import Misalignment
from gearbench.effects.profile_slope import ProfileSlope
from gearbench.effects.root_relief import RootRelief
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.geometry.action import contact_lines
from gearbench.library.garambois2017 import case
from gearbench.scene import Resolution, Scene
from gearbench.solution import solve_scene

BASE = case(2, Resolution(positions=64))
BORED = replace(
    BASE.pair,
    pinion=replace(BASE.pair.pinion, bore_diameter=20.0),
    wheel=replace(BASE.pair.wheel, bore_diameter=80.0),
)
EFFECTS = {
    "tooth_bending": ToothBending(),
    "tooth_bending, solid": ToothBending(model="solid"),
    "gear_body, uncoupled": GearBody(coupled=False),
    "gear_body": GearBody(),
    "crowning": Crowning(amount=4.0),
    "tip_relief": TipRelief(amount=6.0, length=0.5),
    "root_relief": RootRelief(amount=3.0, length=0.3),
    "end_relief": EndRelief(amount=5.0, length=2.5),
    "profile_slope": ProfileSlope(pinion=2.0),
    "helix_slope": HelixSlope(pinion=5.0),
    "manufacturing_errors": ManufacturingErrors(preset="garambois2017"),
    "misalignment": Misalignment(inclination=4.0, deviation=6.0),
}
TOGETHER = tuple(e for n, e in EFFECTS.items() if n not in {"tooth_bending, solid", "gear_body"})


def scene(*effects) -> Scene:
    return replace(BASE, pair=BORED, effects=(Hertz(), *effects))


def seconds(work, repeat: int = 15) -> float:
    """Least processor time of one call."""
    best = math.inf
    for _ in range(repeat):
        start = time.thread_time()
        work()
        best = min(best, time.thread_time() - start)
    return best


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_alone(benchmark, name):
    """Beside the contact law, without which hardly any scene is complete; set up before, as within a study."""
    bare, one = scene(), scene(EFFECTS[name])
    added = seconds(lambda: solve_scene(one)) - seconds(lambda: solve_scene(bare))
    lines = scene_lines(one, mesh_phases(one)[0])
    effect = one.effects[1]
    own = seconds(lambda: effect.gap(lines) if hasattr(effect, "gap") else effect.compliance(lines, {}))
    benchmark.extra_info |= {"adds_us": 1e6 * added, "its_own_term_us": 1e6 * own}
    print(f"\n{name}: adds {1e6 * added:.0f} µs, its own term {1e6 * own:.0f} µs")
    benchmark(solve_scene, one)


def test_all_together_cost_the_sum(benchmark):
    """The terms are computed one by one: together they cost what they cost alone."""
    full = scene(*TOGETHER)
    lines = scene_lines(full, mesh_phases(full)[0])
    alone = sum(
        seconds(lambda e=e: e.gap(lines) if hasattr(e, "gap") else e.compliance(lines, {}))
        for e in (Hertz(), *TOGETHER)
    )
    assembled = seconds(lambda: assemble(full, lines))
    benchmark.extra_info |= {"sum_of_terms_us": 1e6 * alone, "assembled_us": 1e6 * assembled}
    print(f"\nterms {1e6 * alone:.0f} µs, assembled {1e6 * assembled:.0f} µs")
    assert alone < 1.2 * assembled
    benchmark(solve_scene, full)


GAPS = [n for n, e in EFFECTS.items() if isinstance(e, GapEffect)]


@pytest.mark.parametrize("name", GAPS)
def test_the_time_of_a_dropped_gap_is_gone(benchmark, name):
    """The sum of the gaps takes less without it, by its own term; timed in turns."""
    full, rest = scene(*(EFFECTS[n] for n in GAPS)), scene(*(EFFECTS[n] for n in GAPS if n != name))
    lines, effect = scene_lines(full, mesh_phases(full)[0]), EFFECTS[name]
    whole_of, rest_of = full.acting_effects, rest.acting_effects
    works = (lambda: effect.gap(lines), lambda: total_gap(whole_of, lines), lambda: total_gap(rest_of, lines))
    own, whole, left = np.min([[seconds(work, 20) for work in works] for _ in range(30)], axis=0)
    benchmark.extra_info |= {"own_us": 1e6 * own, "saved_us": 1e6 * (whole - left)}
    print(f"\n{name}: its own term {1e6 * own:.0f} µs, saved {1e6 * (whole - left):.0f} µs")
    assert whole - left > 0.5 * own
    benchmark(total_gap, rest_of, lines)


@pytest.mark.parametrize("name", ["tooth_bending", "gear_body, uncoupled"])
def test_the_time_of_a_dropped_compliance_is_gone(benchmark, name):
    """Assembling takes less without it, by its own term at least."""
    other = {"tooth_bending": (), "gear_body, uncoupled": (EFFECTS["tooth_bending"],)}[name]
    full, rest = scene(*other, EFFECTS[name]), scene(*other)
    lines, effect = scene_lines(full, mesh_phases(full)[0]), EFFECTS[name]
    works = (lambda: effect.compliance(lines, {}), lambda: assemble(full, lines), lambda: assemble(rest, lines))
    own, whole, left = np.min([[seconds(work, 5) for work in works] for _ in range(20)], axis=0)
    benchmark.extra_info |= {"own_us": 1e6 * own, "saved_us": 1e6 * (whole - left)}
    print(f"\n{name}: its own term {1e6 * own:.0f} µs, saved {1e6 * (whole - left):.0f} µs")
    assert whole - left > 0.8 * own
    benchmark(assemble, rest, lines)


def by_hand() -> ContactSolution:
    """Result of a scene with Weber–Banaschek's law alone, written for this one case."""
    pair, force = BORED, BASE.F_bn
    tau = (np.arange(64) + 0.5) / 64
    lines = contact_lines(pair, tau, 15)
    nu, E = pair.material.nu, pair.material.E
    c = 4 * (1 - nu**2) / (math.pi * E)
    T = pair.meshing.tangent_length
    rho = np.maximum(lines.u * (T - lines.u) / T / math.cos(pair.meshing.beta_b), 1e-9 * T)
    t1, t2 = (gear.flank_depth(radius) for gear, radius in zip(pair.gears, lines.radii, strict=True))
    a = c * (0.5 * np.log(2 * t1 * t2 / (c * rho)) - nu / (2 * (1 - nu)))
    h = np.full(lines.shape, c / 2)
    q = force / pair.face_width
    unit = q * max(float(np.mean(a - h * math.log(q))), float(np.mean(h)))
    none, gap = np.zeros((*lines.shape, 0)), np.zeros(lines.shape)
    return solve(scale_problem(lines, gap, none, LineLaw(a=a, h=h), gap, force, unit, coupled=False))


def test_an_empty_scene_costs_what_the_same_written_by_hand_costs(benchmark):
    """At most 5 % more. Both are timed in turns, so that what else the machine does falls on both."""
    bare = scene()
    expected, got = by_hand(), solve_scene(bare).solution
    assert np.array_equal(expected.approach, got.approach)
    assert np.array_equal(expected.force, got.force)
    gc.disable()
    try:
        times = [(seconds(by_hand, 5), seconds(lambda: solve_scene(bare), 5)) for _ in range(40)]
    finally:
        gc.enable()
    hand, machinery = (min(t) for t in zip(*times, strict=True))
    ratio = median(b / a for a, b in times)
    benchmark.extra_info |= {"by_hand_us": 1e6 * hand, "scene_us": 1e6 * machinery, "ratio": ratio}
    print(f"\nby hand {1e6 * hand:.0f} µs, scene {1e6 * machinery:.0f} µs, ratio {ratio:.3f}")
    assert ratio <= 1.05
    benchmark(solve_scene, bare)
