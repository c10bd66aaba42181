"""Proof that another process computes what this one does: its code, its packages, and a small evaluation to the bit.

Sources are compared as they are on disk and as they were when this module was imported: a worker may have been started
before they changed. Versions of packages do not tell processors apart, whose compiled kernels may round otherwise; the
evaluation does. Proofs are made of plain mappings, so that those of other versions can be read.
"""

from __future__ import annotations

import hashlib
import platform
import random
from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from gearbench.effects.registry import installed
from gearbench.optimisation.problem import evaluate
from gearbench.optimisation.study import Design, OptimisationStudy

#: Packages whose versions may change a result.
PACKAGES = ("gearbench", "numpy", "scipy", "numba", "llvmlite", "pydantic")
#: Designs that are tried for one that exists, and error samples of it.
TRIED, SAMPLES = 16, 16

#: Parts of a proof, each a mapping: name → text.
Proof = dict[str, dict[str, str]]


def sources() -> dict[str, str]:
    """SHA-256 of each source file of gearbench, its finite elements, and the effects that other packages bring."""
    package = Path(__file__).parents[1]
    found = {
        path.relative_to(package.parent).as_posix(): path
        for folder in (package, package.parent / "fem_reference")
        for path in folder.rglob("*.py")
    }
    for name, entry in installed().items():
        spec = find_spec(entry.module)
        if spec is not None and spec.origin is not None:
            found[f"effect {name}"] = Path(spec.origin)
    return {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in sorted(found.items())}


#: The sources that this process runs.
_AT_IMPORT = sources()


def prove(study: OptimisationStudy) -> Proof:
    """What this process computes ``study`` with, and how it evaluates a design of it."""
    return {"packages": _packages(), "code": sources(), "loaded": _AT_IMPORT, "answer": _answer(study)}


def difference(theirs: Proof, ours: Proof) -> str:
    """The first difference in one line; "" where there is none."""
    for part, sentence in (("packages", "{}: {} there, {} here"), ("code", "code differs: {}")):
        names = _unequal(theirs.get(part, {}), ours[part])
        if names:
            first, more = names[0], f" and {len(names) - 1} more" if len(names) > 1 else ""
            values = (table.get(first, "none") for table in (theirs.get(part, {}), ours[part]))
            return sentence.format(first, *values) + more
    if changed := _unequal(theirs["loaded"], theirs["code"]):
        return f"its code has changed since it was started ({changed[0]}): start it again"
    for name in _unequal(theirs["answer"], ours["answer"]):
        there, here = (table.get(name, "none") for table in (theirs["answer"], ours["answer"]))
        return f"evaluates otherwise, with the same code: {name} = {there} there, {here} here"
    return ""


def _unequal(theirs: Mapping[str, str], ours: Mapping[str, str]) -> list[str]:
    """Names whose texts are not the same."""
    return [name for name in sorted({*theirs, *ours}) if theirs.get(name) != ours.get(name)]


def _packages() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "none"
    return found


def _answer(study: OptimisationStudy) -> dict[str, str]:
    """Statistics of the first of some designs of ``study`` that exists, on few samples and without its limits."""
    few = replace(study.robustness, samples=min(study.robustness.samples, SAMPLES))
    small = replace(study, constraints={}, robustness=few)
    answer = {}
    for number, design in enumerate(_designs(small)):
        result = evaluate(small, design)
        answer |= {f"reason of design {number}": result.reason, "design": str(design)}
        if result.feasible:
            return answer | {name: f"{x!r}" for name, x in zip(small.statistics, result.statistics, strict=True)}
    return answer


def _designs(study: OptimisationStudy) -> Iterator[Design]:
    """Random designs, always the same ones."""
    rng = random.Random(0)
    for _ in range(TRIED):
        yield tuple(
            rng.uniform(*variable.bounds) if variable.kind == "real" else rng.randint(0, int(variable.bounds[1]))
            for variable in study.variables
        )
