"""Parts of a new pair, of a sweep and of a scatter that no better choice of mesh phases saves: ratios of one run."""

import itertools
import time

import numpy as np
import pytest

from benchmarks.pairs import GEARS, on_line, other_torques
from benchmarks.test_loads import TORQUES, least, other_pairs
from gearbench import read_scene, robust, simulate, sweep
from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.gaps import conforming
from gearbench.contact.patches import solve_patches
from gearbench.contact.problem import ContactProblem, part_of, under_shares
from gearbench.contact.smooth import clear_compliance_cache
from gearbench.contact.transitions import loaded_phases
from gearbench.effects.base import ComplianceEffect
from gearbench.library.garambois2017 import gear
from gearbench.results.solved import FinerLines
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.scene import Resolution, Scene
from gearbench.scene_file import scene_at
from gearbench.sweeps.loads import TORQUE
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


@pytest.mark.parametrize("off_line", [False, True], ids=["on the line", "off the line"])
@EACH
def test_twenty_torques_whose_mesh_phases_are_known(benchmark, path, off_line):
    """Sweep and single runs; and assembly, solution and error estimate alone, at the mesh phases of each torque."""
    scene = read_scene(path) if off_line else on_line(path)
    changed = other_torques(scene)
    scenes = [scene_at(scene, {TORQUE: torque}) for torque in TORQUES * scene.load.torque]
    phases = {each: loaded_phases(each)[0] for each in scenes}
    # on the line ``sweep`` assembles about five torques together, off the line each on its own contact lines
    groups = [scenes[i : i + 5] for i in range(0, 20, 5)] if not off_line else [[each] for each in scenes]

    def assembled(group: list[Scene]) -> ContactProblem:
        of_loads = [phases[each] for each in group]
        phase, position = np.unique(np.concatenate(of_loads), return_inverse=True)
        problem = assemble(group[0], scene_lines(group[0], phase))
        if len(group) == 1:
            return problem
        share = np.repeat([each.F_bn / group[0].F_bn for each in group], [len(each) for each in of_loads])
        return under_shares(part_of(problem, position), share)

    def assemblies() -> None:
        clear_compliance_cache()
        for group in groups:
            assembled(group)

    def estimates() -> None:
        clear_compliance_cache()
        for group in groups:
            assert FinerLines(scenes=group, phases=[phases[each] for each in group]).solutions

    problems = [assembled(group) for group in groups]

    @single_threaded_blas()
    def solutions() -> None:
        for problem in problems:
            solve_patches(problem)

    works = {
        "single": lambda: simulate(changed()),
        "sweep": lambda: sweep(scene, torque=changed().load.torque * TORQUES, threads=1),
        "assembly": assemblies, "solution": solutions, "error estimate": estimates,
    }  # fmt: skip
    for work in works.values():
        work()
    times = dict(zip(works, least([*works.values()], time.process_time, 3), strict=True))
    ratios = {name: t / times["single"] for name, t in times.items()}
    floor = ratios["assembly"] + ratios["solution"] + ratios["error estimate"]
    benchmark.extra_info |= {"ms_single": 1e3 * times["single"], "times_single": ratios, "floor": floor}
    parts = ", ".join(f"{name} × {ratio:.1f}" for name, ratio in ratios.items() if name != "single")
    print(f"\n{path.stem}: single {1e3 * times['single']:.1f} ms, {parts}; floor × {floor:.1f}")
    assert floor < ratios["sweep"]
    benchmark.pedantic(works["sweep"], rounds=1)


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
