"""Parts of a new pair, of a sweep and of a scatter that no better choice of mesh phases saves: ratios of one run."""

import itertools
import time

import numpy as np
import pytest

from benchmarks.pairs import GEARS, on_line, other_torques
from benchmarks.test_loads import TORQUES, least, other_pairs
from gearbench import robust, simulate, sweep
from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import conforming
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import part_of, under_shares
from gearbench.contact.smooth import clear_compliance_cache
from gearbench.contact.transitions import loaded_phases
from gearbench.effects.base import ComplianceEffect
from gearbench.library.garambois2017 import gear
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import scene_at
from gearbench.threads import single_threaded_blas

RELIEVED = [path for path in GEARS if not conforming(on_line(path))]
EACH = pytest.mark.parametrize("path", RELIEVED, ids=lambda path: path.stem)


@single_threaded_blas()
def compliances(scene: Scene) -> None:
    """Teeth and bodies of both gears, whatever lines they are on."""
    lines = scene_lines(scene, np.array([0.5]))
    for effect in scene.effects:
        if isinstance(effect, ComplianceEffect):
            effect.flank_compliances(lines, scene.effects_by_name)


@EACH
def test_a_new_pair_whose_mesh_phases_are_known(benchmark, path):
    """Teeth and bodies, then one assembly and one solution at the phases of ``simulate``."""
    scene = on_line(path)
    new = other_pairs(scene, (1.0 - 1e-7 * i for i in itertools.count()))
    phase = loaded_phases(scene)[0]
    lines = scene_lines(scene, phase)
    problem = assemble(scene, lines)

    def once_more() -> None:
        clear_compliance_cache()
        assemble(scene, lines)

    works = [lambda: simulate(new()), lambda: compliances(new()), once_more, lambda: solve_patches(problem)]
    for work in works:
        work()
    whole, gears, assembly, solution = least(works, time.process_time, 7)
    floor = (gears + assembly + solution) / whole
    parts = {"whole": whole, "teeth and bodies": gears, "assembly": assembly, "solution": solution}
    benchmark.extra_info |= {"ms": {name: 1e3 * t for name, t in parts.items()}, "share": floor}
    print(f"\n{path.stem}: {', '.join(f'{name} {1e3 * t:.1f}' for name, t in parts.items())} ms; {100 * floor:.0f} %")
    assert 0.3 < floor < 1.0
    benchmark.pedantic(works[0], rounds=2)


@EACH
def test_twenty_torques_whose_mesh_phases_are_known(benchmark, path):
    """One assembly at the phases of all torques, and each solved at its own."""
    scene = on_line(path)
    changed = other_torques(scene)
    torques = TORQUES * scene.load.torque
    found = [loaded_phases(scene_at(scene, {"load.torque": torque}))[0] for torque in torques]
    phase, position = np.unique(np.concatenate(found), return_inverse=True)
    lines = scene_lines(scene, phase)
    problem = under_shares(part_of(assemble(scene, lines), position), np.repeat(TORQUES, [len(each) for each in found]))

    def once_more() -> None:
        clear_compliance_cache()
        assemble(scene, lines)

    works = [
        lambda: simulate(changed()), lambda: sweep(scene, torque=changed().load.torque * TORQUES, threads=1),
        once_more, lambda: solve_patches(problem),
    ]  # fmt: skip
    for work in works:
        work()
    one, twenty, assembly, solution = least(works, time.process_time, 3)
    floor = (assembly + solution) / one
    benchmark.extra_info |= {"times_one_torque": twenty / one, "times_with_known_phases": floor}
    print(
        f"\n{path.stem}: {len(phase)} phases, twenty × {twenty / one:.1f}, "
        f"assembly × {assembly / one:.1f}, solution × {solution / one:.1f}"
    )
    assert floor < twenty / one
    benchmark.pedantic(works[0], rounds=2)


@pytest.mark.parametrize("name", ["SC", "36", "19", "7"])
def test_samples_of_table_2(benchmark, name):
    """1000 samples by the kernels alone, and what ``robust`` adds."""
    scene = gear(name).scene(errors=True, resolution=Resolution(positions=32))
    problem = prepare_scene(scene)
    errors = problem.draw(1000, 0, "sobol")
    works = [
        lambda: robust(scene, threads=1), lambda: robust(scene, threads=1, shares=False),
        lambda: prepare_scene(scene), lambda: respond(problem, errors, 1),
    ]  # fmt: skip
    for work in works:
        work()
    whole, plain, prepared, alone = (1e3 * t for t in least(works, time.process_time, 7))
    benchmark.extra_info["ms"] = {"whole": whole, "without shares": plain, "preparing": prepared, "samples": alone}
    print(f"\n{name}: {whole:.1f}, without shares {plain:.1f}, preparing {prepared:.1f}, samples {alone:.1f} ms")
    assert alone + prepared < 1.1 * whole
    benchmark.pedantic(works[0], rounds=2)
