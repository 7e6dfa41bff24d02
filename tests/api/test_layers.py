"""The files of `api/` are layers without a circle; the server knows no robotics, the workers know no web framework."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from functools import cache

import pytest

from api.pool.left_out import LEFT_OUT
from tests.locations import ROOT

FOLDERS = (
    "api.base",
    "api.contract.parts",
    "api.contract",
    "api.contract.examples",
    "api.store.contents",
    "api.store",
    "api.store.migrations",
    "api.store.migrations.versions",
    "api.pool",
    "api.telemetry",
    "api.work.answers",
    "api.work.conversion",
    "api.work.tasks",
    "api.work",
    "api.batches",
    "api.http.transport",
    "api.http.access",
    "api.http",
    "api.http.routers",
    "api",
)
"""The layers, from the ground up: a file imports from its own folder and from those above it in this list."""

FILES = {
    ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
    for file in sorted((ROOT / "api").rglob("*.py"))
}
WEB = ("fastapi", "starlette", "uvicorn")
ROBOTICS = ("pinocchio", "casadi", "ruckig", "toppra", "numpy", "eigenpy", "matplotlib")


@cache
def imports(module: str) -> frozenset[str]:
    """Find the modules that a module names in any import; a package stands for its `__init__`."""
    return imports_of(FILES[module].read_text(encoding="utf-8"))


def imports_of(source: str) -> frozenset[str]:
    """Find the modules that a text names in any import, in functions and for the type checker as well."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno} imports relatively"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if name in FILES else str(node.module) for name in names}
    return frozenset(found)


def needed(*modules: str) -> set[str]:
    """Return all files of `api/` that these need, themselves among them."""
    seen: set[str] = set()
    left = set(modules)
    while left:
        module = left.pop()
        seen.add(module)
        left |= (imports(module) & FILES.keys()) - seen
    return seen


def circle(graph: dict[str, set[str]]) -> set[str]:
    """Return the modules that remain after modules without remaining imports are removed repeatedly."""
    left = dict(graph)
    while free := [module for module, others in left.items() if not others & left.keys()]:
        for module in free:
            del left[module]
    return set(left)


def folder_of(module: str) -> str:
    return ".".join(FILES[module].parent.relative_to(ROOT).parts)


def upward(module: str, names: frozenset[str]) -> list[str]:
    """Pick the modules among these from folders above that of a module."""
    own = FOLDERS.index(folder_of(module))
    return sorted(name for name in names & FILES.keys() if FOLDERS.index(folder_of(name)) > own)


def test_every_folder_has_its_layer() -> None:
    assert {folder_of(module) for module in FILES} == set(FOLDERS)


def test_imports_go_down() -> None:
    """Of folders, so that no folders import each other in a circle."""
    assert not {module: found for module in FILES if (found := upward(module, imports(module)))}


@pytest.mark.parametrize(
    ("module", "source", "found"),
    [
        ("api.base.errors", "import api.pool.pool", "api.pool.pool"),
        ("api.pool.pool", "def run():\n    from api.work import execution", "api.work.execution"),
        ("api.store.keys", "if TYPE_CHECKING:\n    from api.http.service import Service", "api.http.service"),
        ("api.http", "from api.http.routers import ROUTERS", "api.http.routers"),
        ("api.batches.engine", "from api import app", "api.app"),
        ("api.work.tasks.robots", "from api.work import entry", "api.work.entry"),
    ],
)
def test_an_import_of_a_layer_above_is_seen(module: str, source: str, found: str) -> None:
    assert upward(module, imports_of(source)) == [found]


def test_there_is_no_circle() -> None:
    assert not circle({module: set(imports(module)) - {module} for module in FILES})


def test_a_circle_would_be_seen() -> None:
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}) == {"a", "b", "c", "d"}


def test_the_service_knows_no_command_line() -> None:
    assert not {module for module in FILES if any(name.split(".")[0] == "cli" for name in imports(module))}


def test_only_the_server_knows_the_web_framework() -> None:
    know_it = {module for module in FILES if any(name.split(".")[0] in WEB for name in imports(module))}
    assert know_it
    assert not know_it & needed("api.pool.worker_process", "api.work.execution")


def test_the_pool_knows_no_http_no_database_and_no_robotics() -> None:
    """Nor does anything that it needs; the work of its workers is handed in."""
    needs = needed(*(module for module in FILES if folder_of(module) == "api.pool"))
    foreign = {*WEB, *ROBOTICS, "http", "h11", "sqlalchemy", "planner"}
    assert not {name for module in needs for name in imports(module) if name.split(".")[0] in foreign}
    assert {folder_of(module) for module in needs} == {"api.pool", "api.base"}


@cache
def loaded(code: str) -> set[str]:
    """List packages and modules that are loaded after some code has run in a fresh interpreter."""
    program = f"import json, sys\n{code}\nprint(json.dumps(sorted(name for name in sys.modules if sys.modules[name])))"
    ran = subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True, capture_output=True, text=True)
    return set(json.loads(ran.stdout.splitlines()[-1]))


def test_the_server_loads_no_robotics() -> None:
    """Not by its imports, and not by making the application with all its routes."""
    modules = loaded("import api.process, api.app\nassert api.app.create_app(pool=object()).routes")
    assert not modules & set(ROBOTICS)
    assert {name for name in modules if name.split(".")[0] == "planner"} <= {
        "planner",
        "planner.errors",
        "planner.fields",
    }
    assert "api.http.routers.trajectories" in modules


def test_the_server_loads_nothing_for_consoles_and_no_old_pydantic() -> None:
    """They took 9 MB of its memory: more than all routes."""
    by_default = "import api.process, api.app\nassert api.app.create_app(pool=object()).routes"
    modules = loaded(f"from api.pool.left_out import leave_out\nleave_out()\n{by_default}")
    assert {"structlog.dev", "mako.exceptions", "fastapi.routing"} <= modules  # these import them
    assert not {name for name in modules if name.startswith(LEFT_OUT)}
    assert set(LEFT_OUT) <= loaded(by_default)  # one that no library imports any more need not be named


def test_a_worker_loads_no_web_framework_and_no_database() -> None:
    modules = loaded("import api.work.execution\nfrom api.work.tasks.context import TASKS\nassert TASKS")
    assert not modules & {*WEB, "sqlalchemy"}
    assert "planner.export" in modules


@pytest.mark.parametrize("module", ["api.pool.worker_process", "api.pool.messages"])
def test_what_a_worker_imports_before_its_limits_are_set_is_light(module: str) -> None:
    assert not loaded(f"import {module}") & {*ROBOTICS, *WEB, "pydantic"}
