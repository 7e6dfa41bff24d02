"""`planner/` is a list of layers: no file imports from above its own layer, and there is no circle of imports."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest

from tests.locations import ROOT
from tests.planner.layers import LAYERS

BACK_ENDS = (
    "base",
    "shared",
    ("splines", "trapezoidal", "jerk_limited"),
    ("ruckig", "toppra", "min_effort"),
    "auto",
    "",
)
"""The same inside `planner/backends/`; those in one bracket do not know each other."""

FILES = sorted((ROOT / "planner").rglob("*.py"))


def module_of(file: Path) -> str:
    return ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_of(file): file for file in FILES}


@cache
def imports(module: str) -> tuple[tuple[str, int], ...]:
    """Modules of `planner` that a module names in any import, wherever it stands, and the lines."""
    found = []
    for node in ast.walk(ast.parse(MODULES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}:{node.lineno} imports relatively"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found += [(name if name in MODULES else str(node.module), node.lineno) for name in names]
    return tuple((name, line) for name, line in found if name.split(".")[0] == "planner")


def rank(parts: list[str], layers: tuple[str | tuple[str, ...], ...]) -> int:
    first = parts[0] if parts else ""
    return next(k for k, layer in enumerate(layers) if first == layer or (isinstance(layer, tuple) and first in layer))


def is_downward(source: str, target: str) -> bool:
    own, other = source.split(".")[1:], target.split(".")[1:]
    if (low := rank(other, LAYERS)) != (high := rank(own, LAYERS)):
        return low < high
    if own[:1] != ["backends"] or own[1:2] == other[1:2]:
        return True  # inside one folder: the test of circles holds that
    return rank(other[1:], BACK_ENDS) < rank(own[1:], BACK_ENDS)


@pytest.mark.parametrize("module", MODULES)
def test_imports_go_down(module: str) -> None:
    upward = [f"line {line}: {name}" for name, line in imports(module) if not is_downward(module, name)]
    assert not upward, f"{module} imports from above or beside it"


def test_every_layer_is_there() -> None:
    first_names = {(module.split(".")[1:] or [""])[0] for module in MODULES}
    assert first_names == set(LAYERS)


def test_no_circles() -> None:
    """What is left when modules without imports that are left go, again and again."""
    left = {module: {name for name, _ in imports(module)} - {module} for module in MODULES}
    while free := [module for module, needed in left.items() if not needed & left.keys()]:
        for module in free:
            del left[module]
    assert not left


@pytest.mark.parametrize(("own", "other"), [("rows", "peaks"), ("peaks", "rows")])
def test_rows_and_peaks_know_nothing_of_each_other(own: str, other: str) -> None:
    """What back ends time a path by, and what the certificate finds, have only the values of a quantity in common."""
    seen, waiting = set(), [f"planner.constraints.{own}"]
    while waiting:
        seen.add(module := waiting.pop())
        waiting += [name for name, _ in imports(module) if name not in seen and name.startswith("planner.constraints.")]
    assert f"planner.constraints.{other}" not in seen


def test_the_checks_see_what_is_wrong() -> None:
    assert not is_downward("planner.kinematics", "planner.limits")
    assert not is_downward("planner.backends.ruckig.ruckig", "planner.backends.toppra.toppra")
    assert not is_downward("planner.backends.shared.assembly", "planner.backends.splines.cubic")
    assert not is_downward("planner.errors", "planner")
    assert is_downward("planner.backends.toppra.toppra", "planner.backends.trapezoidal.along_curve")
