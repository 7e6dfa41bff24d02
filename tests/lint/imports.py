"""Rules for imports: layers without a circle, and packages that a folder must not know."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from tests.lint.sources import python
from tests.planner.layers import BACK_ENDS, LAYERS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.lint.sources import Fault, Source, Sources

WEB = {"fastapi", "starlette", "uvicorn"}
DRAWING = {"matplotlib", "mpl_toolkits"}
VIEWING = {"viser"}
FORBIDDEN = {
    "planner": WEB | DRAWING | VIEWING | {"api", "cli", "pydantic", "httpx", "socket", "rich"},
    "api": {"cli", "pinocchio", "casadi", "ruckig", "toppra"},
    "benchmarks": {"tests", "docs"},
    "docs": {"tests"},
    "tests/planner": {"api", "cli"},
}
ALLOWED = {"planner/plots": DRAWING | VIEWING}
"""Packages that a folder must not import, and exceptions for folders inside."""

STRANGERS = [
    ("planner.constraints.rows", "planner.constraints.peaks"),
    ("planner.constraints.peaks", "planner.constraints.rows"),
]
"""Modules of which the first reaches the second by no chain of imports inside its folder."""


def imports(source: Source, modules: set[str]) -> Iterator[tuple[str, int]]:
    """Yield the modules that a file names in any import, wherever it stands, and the lines."""
    for node in source.nodes:
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from ((name if name in modules else str(node.module), node.lineno) for name in names)


def modules_of(sources: Sources, *packages: str) -> set[str]:
    """Return the names of the modules of some packages."""
    return {source.module for source in python(sources, *packages)}


def relative_imports(sources: Sources) -> Iterator[Fault]:
    """Find imports that do not name their module in full."""
    for source in python(sources):
        for node in source.nodes:
            if isinstance(node, ast.ImportFrom) and node.level > 0:
                yield source.fault(node.lineno, "the import is relative")


def forbidden_imports(sources: Sources) -> Iterator[Fault]:
    """Find imports of packages that are forbidden in a folder."""
    for folder, packages in FORBIDDEN.items():
        for source in python(sources, folder.partition("/")[0]):
            if not source.file.startswith(f"{folder}/"):
                continue
            allowed = set().union(*(names for inner, names in ALLOWED.items() if source.file.startswith(f"{inner}/")))
            for package, line in {(name.split(".")[0], line) for name, line in imports(source, set())}:
                if package in packages - allowed:
                    yield source.fault(line, f"{folder}/ must not import {package}")


def names_of(source: Source) -> set[str]:
    """Return every name that a file binds anywhere, also inside its functions."""
    found = set()
    for node in source.nodes:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                found.add(name)
            case ast.Name(id=name, ctx=ast.Store()):
                found.add(name)
            case ast.Import(names=aliases) | ast.ImportFrom(names=aliases):
                found |= {alias.asname or alias.name.split(".")[0] for alias in aliases}
    return found


def missing_names(sources: Sources) -> Iterator[Fault]:
    """Find names that a file imports from a module of the repository which has no such name."""
    modules = {source.module: names_of(source) for source in python(sources)}
    names = {module: found for module, found in modules.items() if not {"*", "__getattr__"} & found}
    for source in python(sources):
        for node in source.nodes:
            if isinstance(node, ast.ImportFrom) and node.module in names:
                for alias in node.names:
                    if alias.name not in names[node.module] and f"{node.module}.{alias.name}" not in modules:
                        yield source.fault(node.lineno, f"{node.module} has no {alias.name}")


def imported_tests(sources: Sources) -> Iterator[Fault]:
    """Find imports of test modules, since shared helpers belong in a file of their own."""
    modules = modules_of(sources, "tests")
    for source in python(sources):
        for name, line in imports(source, modules):
            if name.startswith("tests.") and any(part.startswith("test_") for part in name.split(".")):
                yield source.fault(line, f"{name} is a test module: move what it shares to a file of its own")


def public_names(sources: Sources) -> set[str]:
    """Return the names that the library offers: in its stub, and in the `__all__` of its folders."""
    found = set()
    for source in sources:
        if source.file == "planner/__init__.pyi":
            found |= {alias.name for node in source.nodes if isinstance(node, ast.ImportFrom) for alias in node.names}
        elif source.file.startswith("planner/") and source.file.endswith("/__init__.py"):
            for node in source.nodes:
                if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
                    found |= {name.value for name in ast.walk(node.value) if isinstance(name, ast.Constant)}
    return found


def inner_names(sources: Sources) -> Iterator[Fault]:
    """Find imports of names that the library does not offer; folders of the library may be imported whole."""
    public = public_names(sources)
    for source in python(sources, "api", "cli"):
        for node in source.nodes:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("planner."):
                for alias in node.names:
                    if alias.name not in public:
                        yield source.fault(node.lineno, f"{alias.name} is no public name of {node.module}")


def _rank(parts: list[str], layers: tuple[str | tuple[str, ...], ...]) -> int:
    first = parts[0] if parts else ""
    ranks = (k for k, layer in enumerate(layers) if first == layer or (isinstance(layer, tuple) and first in layer))
    return next(ranks, -1)


def is_downward(source: str, target: str) -> bool:
    """Return whether a module of `planner` may import another one, circles inside a folder apart."""
    own, other = source.split(".")[1:], target.split(".")[1:]
    if (low := _rank(other, LAYERS)) != (high := _rank(own, LAYERS)):
        return low < high
    if own[:1] != ["backends"] or own[1:2] == other[1:2]:
        return True
    return _rank(other[1:], BACK_ENDS) < _rank(own[1:], BACK_ENDS)


def layers(sources: Sources) -> Iterator[Fault]:
    """Find imports of `planner/` from the same layer or a higher one, and files without a layer."""
    modules = modules_of(sources, "planner")
    for source in python(sources, "planner"):
        if _rank(source.module.split(".")[1:], LAYERS) < 0:
            yield source.fault(1, "has no place in tests/planner/layers.py")
        for name, line in imports(source, modules):
            if name.split(".")[0] == "planner" and not is_downward(source.module, name):
                yield source.fault(line, f"imports {name} from above or beside it (tests/planner/layers.py)")


def circles(sources: Sources) -> Iterator[Fault]:
    """Find circles of imports by repeated removal of modules without imports."""
    for package in ("planner", "api", "cli", "benchmarks"):
        modules = {source.module: source for source in python(sources, package)}
        left = {name: {m for m, _ in imports(source, set(modules))} - {name} for name, source in modules.items()}
        while free := [name for name, needed in left.items() if not needed & left.keys()]:
            for name in free:
                del left[name]
        for name in left:
            yield modules[name].fault(1, f"is in, or imports, a circle: {', '.join(sorted(left[name] & left.keys()))}")


def strangers(sources: Sources) -> Iterator[Fault]:
    """Find modules that reach, by imports inside their folder, a module that they must not know."""
    modules = {source.module: source for source in python(sources)}
    for own, other in STRANGERS:
        folder = own.rpartition(".")[0] + "."
        seen, waiting = set(), [own] if own in modules else []
        while waiting:
            seen.add(module := waiting.pop())
            found = {name for name, _ in imports(modules[module], set(modules)) if name.startswith(folder)}
            waiting += (found & modules.keys()) - seen
        if other in seen:
            yield modules[own].fault(1, f"reaches {other} by its imports")
