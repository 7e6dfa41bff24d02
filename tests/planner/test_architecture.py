"""The dependency rule, held by reading the imports."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.locations import ROOT


def imported_modules(file: Path) -> set[str]:
    modules: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            modules.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules.add(node.module)
    return {module.split(".")[0] for module in modules}


@pytest.mark.parametrize("file", sorted((ROOT / "planner").rglob("*.py")), ids=lambda f: str(f.relative_to(ROOT)))
def test_planner_knows_no_http(file: Path) -> None:
    forbidden = {"api", "cli", "fastapi", "starlette", "pydantic", "uvicorn", "httpx", "socket", "rich"}
    draws = ROOT / "planner/plots" in file.parents
    assert not imported_modules(file) & (forbidden if draws else forbidden | {"matplotlib", "mpl_toolkits"})


@pytest.mark.parametrize("file", sorted((ROOT / "planner").rglob("*.py")), ids=lambda f: str(f.relative_to(ROOT)))
def test_planner_speaks_of_its_own_types(file: Path) -> None:
    """No JSON pointer into a request, and no object of a request; what is exported has the form of an answer."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            assert not re.match(r"/[a-z_]+(/|$)", node.value), f"line {node.lineno}: {node.value!r} is a pointer"
        if isinstance(node, ast.Dict) and not {"export", "robots"} & set(file.relative_to(ROOT).parts):
            keys = {key.value for key in node.keys if isinstance(key, ast.Constant)}
            assert "kind" not in keys, f"line {node.lineno}: a value of a request"


@pytest.mark.parametrize("file", sorted((ROOT / "api").rglob("*.py")), ids=lambda f: str(f.relative_to(ROOT)))
def test_api_knows_no_robotics(file: Path) -> None:
    assert not imported_modules(file) & {"pinocchio", "casadi", "ruckig", "toppra"}


def test_a_worker_stays_small() -> None:
    """scipy alone would add 60 MB and half a second to every worker, matplotlib more."""
    code = "import sys, planner.planning, planner.export, planner.certificate.samples; print(*sorted(sys.modules))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert not {"scipy", "matplotlib", "toppra", "casadi", "fastapi"} & set(result.stdout.split())
