"""`import planner`: the names that it offers, its cost, and the results that its docstrings show."""

from __future__ import annotations

import ast
import doctest
import json
import subprocess
import sys
from importlib import import_module

import pytest

import planner
from tests.locations import ROOT

PACKAGE = ROOT / "planner"
SOLVERS = {"casadi", "matplotlib", "numpy", "orjson", "pinocchio", "ruckig", "scipy", "toppra"}
MODULES = {
    ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
    for file in sorted(PACKAGE.rglob("*.py"))
}
WITH_EXAMPLES = [module for module, file in MODULES.items() if ">>>" in file.read_text(encoding="utf-8")]

IN_A_NEW_PROCESS = """
import json, sys
import planner
before = sorted({module.split(".")[0] for module in sys.modules})
robot = planner.load_robot("three_dof_arm")
print(json.dumps({"before": before, "after": sorted(sys.modules), "plan": repr(planner.plan)}))
"""


@pytest.mark.large_only
def test_importing_it_loads_nothing_else() -> None:
    ran = subprocess.run([sys.executable, "-c", IN_A_NEW_PROCESS], check=True, capture_output=True, cwd=ROOT, text=True)
    found = json.loads(ran.stdout)
    assert not SOLVERS & set(found["before"])
    assert "pinocchio" in found["after"], "the robot came without Pinocchio: the check above proves nothing"
    assert found["plan"].startswith("<function plan")


def test_type_checkers_see_the_names_that_there_are() -> None:
    """The names imported for type checkers are the names loaded on use."""
    _, *imports, names = ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8")).body
    assert isinstance(names, ast.AnnAssign), "the last line declares `__all__`"
    seen = {}
    for node in imports:
        assert isinstance(node, ast.ImportFrom)
        for alias in node.names:
            assert alias.name == alias.asname, "only what is imported `as` itself is public"
            seen[alias.name] = getattr(import_module(str(node.module)), alias.name)
    assert sorted(seen) == planner.__all__
    for name, value in seen.items():
        assert getattr(planner, name) is value
    assert (PACKAGE / "py.typed").is_file()


def test_no_name_is_a_modules() -> None:
    """Importing a module puts it into its package: `planner.plan` was a function until `planner/plan.py` was loaded."""
    assert not set(planner.__all__) & {module.split(".")[1] for module in MODULES if "." in module}


def test_names_are_listed_and_others_are_not_there() -> None:
    assert set(planner.__all__) <= set(dir(planner))
    assert len(planner.__all__) == len(set(planner.__all__))
    with pytest.raises(AttributeError, match="'planner' has no attribute 'Planner'"):
        _ = planner.Planner  # type: ignore[attr-defined]
    namespace: dict[str, object] = {}
    exec("from planner import *", namespace)  # noqa: S102
    assert set(planner.__all__) <= set(namespace)


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_docstrings_show_what_happens(module: str) -> None:
    failures, tried = doctest.testmod(import_module(module), optionflags=doctest.ELLIPSIS)
    assert (failures, tried > 0) == (0, True)
