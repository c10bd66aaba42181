"""The house: imports point downward, the package is light to import, files and functions stay small."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted(p for folder in ("gearbench", "fem_reference") for p in (ROOT / folder).rglob("*.py"))

#: A module may import from its own layer and from those before it.
LAYERS = (
    ("errors", "quantities", "notebook"),
    ("geometry",),
    ("tolerances",),
    ("compliance",),
    ("system",),
    ("effects",),
    ("scene", "scene_file"),
    ("contact",),
    ("accuracy",),
    ("cycle", "files", "outputs", "provenance", "results", "simulation", "library", "stopwatch"),
    ("robustness", "strength", "exchange"),
    ("response",),
    ("plotting", "plan", "doctor"),
    ("optimise", "cost"),
    ("validation",),
    ("explore",),
    ("cli", "__main__"),
)
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}


def imports(path: Path, *, everywhere: bool) -> set[str]:
    """Dotted names imported by a module: at its top, or anywhere; those for type checkers only do not count."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = set()
    stack: list[ast.AST] = [tree]
    while stack:
        node = stack.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if not everywhere and isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module}
        stack.extend(ast.iter_child_nodes(node))
    return found


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_point_downward(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    if parts[0] == "fem_reference":
        allowed = {"gearbench.geometry", "gearbench.compliance", "gearbench.errors"}
        for name in imports(path, everywhere=True):
            if name.startswith("gearbench"):
                assert ".".join(name.split(".")[:2]) in allowed, name
        return
    if parts == ("gearbench", "__init__"):
        return
    level = LEVEL[parts[1]]
    for name in imports(path, everywhere=True):
        if name.startswith("gearbench."):
            assert LEVEL[name.split(".")[1]] <= level, f"{'.'.join(parts)} imports {name}"
        if name.startswith("fem_reference"):
            assert parts[1] in {"cost", "doctor", "effects", "validation"}, name


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_heavy_packages_are_imported_where_they_are_used(path):
    if path.parts[-2] == "fem_reference" or path.name.endswith("kernels.py"):
        heavy = {"gmsh", "matplotlib", "pymoo", "dask", "pypardiso"}
    else:
        heavy = {"gmsh", "skfem", "pymoo", "dask", "distributed", "matplotlib", "numba", "xarray", "rich"}
    heavy |= set() if path.name.startswith("symbolic") else {"sympy"}
    top = {name.split(".")[0] for name in imports(path, everywhere=False)}
    assert not top & heavy


def test_importing_the_package_imports_next_to_nothing():
    heavy = ["numpy", "scipy", "numba", "pydantic", "xarray", "matplotlib", "gmsh", "skfem", "sympy", "rich", "typer"]
    code = f"import sys, gearbench; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_files_and_functions_stay_small_and_documented(path):
    text = path.read_text(encoding="utf-8")
    assert text.count("\n") <= 400
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            assert node.end_lineno - node.lineno <= 60, node.name
    for owner in (tree, *(node for node in tree.body if isinstance(node, ast.ClassDef))):
        for node in owner.body:
            if (
                isinstance(node, ast.FunctionDef)
                and not node.name.startswith("_")
                and node.end_lineno - node.lineno > 5
            ):
                assert ast.get_docstring(node), node.name
