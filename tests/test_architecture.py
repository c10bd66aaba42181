"""The house: imports point downward, the package is light to import, public functions say what they do."""

import ast
import re
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from tests.support.paths import ROOT

PATHS = [path for folder in ("gearbench", "fem_reference", "studies") for path in sorted((ROOT / folder).rglob("*.py"))]
MODULES = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in PATHS}


@cache
def trees() -> dict[Path, ast.Module]:
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in PATHS}


def layers() -> dict[str, int]:
    """Height of each part of the house, from the lines that docs/map.md prints."""
    printed = re.search(
        r"<!-- layers -->.*?```text\n(.*?)```", (ROOT / "docs" / "map.md").read_text(encoding="utf-8"), re.DOTALL
    )
    assert printed is not None
    lines = reversed(printed[1].splitlines())
    return {name: height for height, line in enumerate(lines) for name in line.split(", ")}


LAYERS = layers()


def part(module: str) -> str:
    """The part of the house that a module belongs to: the longest name of ``LAYERS`` that leads to it."""
    name = "__init__" if module == "gearbench" else module.removeprefix("gearbench.")
    while name not in LAYERS:
        assert "." in name, f"{module} stands in no line of docs/map.md"
        name = name.rpartition(".")[0]
    return name


def imports(tree: ast.AST, *, everywhere: bool = True) -> set[str]:
    """Dotted names imported by a module, anywhere or at its top; those for type checkers only do not count."""
    found = set()
    stack: list[ast.AST] = [tree]
    while stack:
        node = stack.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            stack.extend(node.orelse)
            continue
        if not everywhere and isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            base = f"gearbench.{node.module}" if node.level else node.module
            found |= {name if (name := f"{base}.{alias.name}") in MODULES else base for alias in node.names}
        stack.extend(ast.iter_child_nodes(node))
    return found


def needs(module: str) -> set[str]:
    """Modules of the project that ``module`` imports; of the public names the stub says where they come from."""
    path = MODULES[module]
    tree = ast.parse(path.with_suffix(".pyi").read_text(encoding="utf-8")) if module == "gearbench" else trees()[path]
    return {name for name in imports(tree) if name in MODULES} - {module}


@cache
def all_needs() -> dict[str, set[str]]:
    return {module: needs(module) for module in MODULES}


def test_every_line_names_parts_that_exist():
    assert {part(module) for module in MODULES} == set(LAYERS)


def test_imports_point_downward():
    above = {"effort", "doctor", "plot", "effects", "validation", "studies", "fem_reference", "fem_reference.contact"}
    for module, others in all_needs().items():
        own = part(module)
        for other in others:
            assert part(other) == own or LAYERS[part(other)] < LAYERS[own], f"{module} imports {other}"
            assert part(other) != "fem_reference" or own in above, f"{module} imports {other}"


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Nodes of a circle of ``graph``, empty where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_no_modules_import_each_other_in_a_circle():
    assert circle(all_needs()) == []


def test_no_packages_import_each_other_in_a_circle():
    graph: dict[str, set[str]] = {part(module): set() for module in MODULES}
    for module, others in all_needs().items():
        graph[part(module)] |= {part(other) for other in others} - {part(module)}
    assert circle(graph) == []


def test_heavy_packages_are_imported_where_they_are_used():
    for path, tree in trees().items():
        if path.parts[-2] == "fem_reference" or path.name.endswith("kernels.py"):
            heavy = {"gmsh", "matplotlib", "pymoo", "dask", "pypardiso"}
        else:
            heavy = {"gmsh", "skfem", "pymoo", "dask", "distributed", "matplotlib", "numba", "xarray", "rich", "sympy"}
        top = {name.split(".")[0] for name in imports(tree, everywhere=False)}
        assert not top & heavy, path


def test_importing_the_package_imports_next_to_nothing_and_commands_import_what_they_use():
    heavy = ["numpy", "scipy", "numba", "pydantic", "xarray", "matplotlib", "gmsh", "skfem", "sympy", "rich", "typer"]
    of_some = ["bokeh", "tornado", "pandas", "pymoo", "dask", "distributed", "h5py"]
    code = f"import sys, gearbench; print([m for m in {heavy} if m in sys.modules])\n"
    code += f"import gearbench.cli.app; print([m for m in {of_some} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n[]\n"


def test_the_help_imports_no_package_for_numbers():
    """All commands are imported for the list of their names."""
    code = "import sys; from gearbench.cli.app import application; application();"
    code += "print([m for m in ('numpy', 'pydantic', 'scipy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_a_lazy_package_is_imported_when_one_of_its_names_is_used():
    code = "import sys; from gearbench.lazy import xr; print('xarray' in sys.modules);"
    code += "print(xr.Dataset is sys.modules['xarray'].Dataset)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\nTrue\n"


def test_public_functions_are_documented():
    for path, tree in trees().items():
        for owner in (tree, *(node for node in tree.body if isinstance(node, ast.ClassDef))):
            for node in owner.body:
                public = isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
                if public and node.end_lineno - node.lineno > 5:
                    assert ast.get_docstring(node), f"{node.name} in {path}"


def test_kernels_take_twelve_arguments_at_most():
    """Other functions take 8, which ruff sees to."""
    for path, tree in trees().items():
        if path.name.endswith("kernels.py"):
            for node in ast.walk(tree):
                assert not isinstance(node, ast.FunctionDef) or len(node.args.args) <= 12, f"{node.name} in {path}"
