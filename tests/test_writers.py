"""Writer by writer: how whoever reads a file of gearbench knows that it is whole, or why nobody needs to."""

import ast

from tests.support.paths import ROOT

#: Calls that write a file.
WRITES = {"write_bytes", "write_text", "savefig", "savez", "fdopen", "to_netcdf", "tofile", "save_png"}

SEALED = "ends in the digest of its bytes, which its reader checks"
OWN = "holds a digest of its numbers, which its reader checks"
TO_READ = "for people and other programs: gearbench does not read it back"
BY_HAND = "text that people change, read as such: a key or value that is not allowed is named"
PASSING = "lives as long as the process that reads it"

#: Module → how its readers know.
WRITERS = {
    "gearbench/files.py": "the mechanism itself: beside the name, then in its place",
    "gearbench/results/netcdf.py": SEALED,  # also of generations and what is kept of sweeps
    "gearbench/optimisation/store.py": "study.toml: compared with the study, letter by letter, before a run goes on",
    "gearbench/cli/select.py": f"csv, md: {TO_READ}; toml: {BY_HAND}",
    "gearbench/cli/rexs.py": BY_HAND,
    "gearbench/cli/verify.py": TO_READ,
    "gearbench/cli/relieve.py": BY_HAND,
    "gearbench/html.py": TO_READ,
    "gearbench/pair_report.py": TO_READ,
    "gearbench/cli/explore.py": TO_READ,
    "gearbench/cli/report.py": TO_READ,
    "gearbench/explore/static.py": TO_READ,
    "gearbench/dynamics/figures.py": TO_READ,
    "gearbench/dynamics/sound.py": TO_READ,
    "gearbench/plotting.py": TO_READ,
    "gearbench/validation/report.py": TO_READ,
    "gearbench/exchange/rexs_results.py": "REXS, whose standard has no digest",
    "fem_reference/cache.py": OWN,
    "fem_reference/contact/calculix.py": PASSING,
    "fem_reference/contact/result.py": SEALED,
    "studies/s01_table2/pictures.py": TO_READ,
    "studies/s04_paper_validation/pictures.py": TO_READ,
    "studies/s06_paper_fronts/search.py": "times of the legs of a search, for its report alone",
    "studies/s06_paper_fronts/tables.py": TO_READ,
    "studies/s07_accuracy_cost/bodies.py": TO_READ,
    "studies/s10_fronts_on_bodies/pictures.py": TO_READ,
    "studies/s11_gears_in_use/data.py": SEALED,
    "studies/s12_fronts_off_line/pictures.py": TO_READ,
}


def writers():
    """Modules that write files."""
    found = set()
    for package in ("gearbench", "fem_reference", "studies"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Call):
                    name = getattr(node.func, "attr", getattr(node.func, "id", None))
                    if name in WRITES or (name == "open" and any(_writing(each) for each in _values(node))):
                        found.add(path.relative_to(ROOT).as_posix())
    return found


def _values(call):
    return [*call.args, *(keyword.value for keyword in call.keywords)]


def _writing(node):
    """Whether an argument of ``open`` is a mode for writing."""
    text = node.value if isinstance(node, ast.Constant) else None
    return isinstance(text, str) and set(text) <= set("rwaxbt+") and bool(set(text) & set("wax+"))


def test_every_writer_is_known_with_how_its_readers_know():
    assert writers() == set(WRITERS)
