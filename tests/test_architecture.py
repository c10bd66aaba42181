"""The house: imports point downward, the package is light to import, files and functions stay small."""

import ast
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter

import pytest

from tests.support.paths import ROOT

SOURCES = sorted(p for folder in ("gearbench", "fem_reference") for p in (ROOT / folder).rglob("*.py"))
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in (*SOURCES, *(ROOT / "studies").rglob("*.py"))
}


def layers() -> dict[str, int]:
    """Height of each part of the house, from the lines that README and docs/map.md print."""
    printed = re.search(
        r"<!-- layers -->.*?```text\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL
    )
    assert printed is not None
    lines = reversed(printed[1].splitlines())
    return {name: height for height, line in enumerate(lines) for name in line.split(", ")}


LAYERS = layers()


def part(module: str) -> str:
    """The part of the house that a module belongs to: the longest name of ``LAYERS`` that leads to it."""
    name = "__init__" if module == "gearbench" else module.removeprefix("gearbench.")
    while name not in LAYERS:
        assert "." in name, f"{module} stands in no line of README.md"
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
    path = path.with_suffix(".pyi") if module == "gearbench" else path
    return {name for name in imports(ast.parse(path.read_text(encoding="utf-8"))) if name in MODULES} - {module}


NEEDS = {module: needs(module) for module in MODULES}


def test_every_line_names_parts_that_exist():
    assert {part(module) for module in MODULES} == set(LAYERS)


@pytest.mark.parametrize("module", MODULES)
def test_imports_point_downward(module):
    own = part(module)
    for other in NEEDS[module]:
        assert part(other) == own or LAYERS[part(other)] < LAYERS[own], f"{module} imports {other}"
        if part(other) == "fem_reference":
            allowed = {"effort", "doctor", "effects", "validation", "studies", "fem_reference", "fem_reference.contact"}
            assert own in allowed, other


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Nodes of a circle of ``graph``, empty where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_no_modules_import_each_other_in_a_circle():
    assert circle(NEEDS) == []


def test_no_packages_import_each_other_in_a_circle():
    graph: dict[str, set[str]] = {part(module): set() for module in MODULES}
    for module, others in NEEDS.items():
        graph[part(module)] |= {part(other) for other in others} - {part(module)}
    assert circle(graph) == []


def test_circles_and_imports_in_functions_are_seen():
    text = "from gearbench.scene import Scene\ndef f():\n    from gearbench.contact import dense\n"
    assert imports(ast.parse(text)) == {"gearbench.scene", "gearbench.contact.dense"}
    assert imports(ast.parse(text), everywhere=False) == {"gearbench.scene"}
    assert set(circle({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}})) == {"a", "b", "c"}


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_heavy_packages_are_imported_where_they_are_used(path):
    if path.parts[-2] == "fem_reference" or path.name.endswith("kernels.py"):
        heavy = {"gmsh", "matplotlib", "pymoo", "dask", "pypardiso"}
    else:
        heavy = {"gmsh", "skfem", "pymoo", "dask", "distributed", "matplotlib", "numba", "xarray", "rich"}
    heavy |= set() if path.name.startswith("symbolic") else {"sympy"}
    tree = ast.parse(path.read_text(encoding="utf-8"))
    top = {name.split(".")[0] for name in imports(tree, everywhere=False)}
    assert not top & heavy


def test_importing_the_package_imports_next_to_nothing():
    heavy = ["numpy", "scipy", "numba", "pydantic", "xarray", "matplotlib", "gmsh", "skfem", "sympy", "rich", "typer"]
    code = f"import sys, gearbench; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_public_functions_are_documented(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for owner in (tree, *(node for node in tree.body if isinstance(node, ast.ClassDef))):
        for node in owner.body:
            if (
                isinstance(node, ast.FunctionDef)
                and not node.name.startswith("_")
                and node.end_lineno - node.lineno > 5
            ):
                assert ast.get_docstring(node), node.name
