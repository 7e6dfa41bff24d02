"""The clients of four languages are generated, compiled as they are, plan, meet a problem and run a batch.

They need node (extra `clients`), a JDK, Debian's `libgeronimo-annotation-1.3-spec-java`, and Go: `.ci/run` has them.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from clients.document import document
from clients.generate import GENERATORS, TYPESCRIPT
from tests.api.conftest import RunningService, running_service
from tests.api.requests import joint, plan_request

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PROGRAMS = Path(__file__).parent / "programs"
ANNOTATIONS = Path("/usr/share/java/geronimo-annotation-1.3-spec.jar")
"""`javax.annotation.Generated`, which a project would get from Maven's repository."""

GO_MODULE = """module plan
go 1.19
require example.com/planner/client v0.0.0
replace example.com/planner/client => ./client
"""
TYPESCRIPT_OPTIONS = ("--strict", "--noEmitOnError", "--skipLibCheck", "--target", "es2022", "--module", "commonjs")
NODE_TYPES = "@types/node@24.10.1"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    with running_service(tmp_path_factory.mktemp("service") / "log.jsonl") as running:
        yield running


@pytest.fixture(scope="module")
def openapi(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("document") / "openapi.json"
    file.write_bytes(document())
    return file


def run(folder: Path, *command: Any) -> str:
    done = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command[0]}:\n{done.stdout}{done.stderr}"
    return done.stdout


def python(openapi: Path, folder: Path, url: str) -> str:
    GENERATORS["python"](openapi, folder / "planner_client")
    shutil.copy(PROGRAMS / "plan.py", folder)
    run(folder, sys.executable, "-m", "mypy", "--strict", "plan.py")
    return run(folder, sys.executable, "plan.py", url)


def typescript(openapi: Path, folder: Path, url: str) -> str:
    GENERATORS["typescript"](openapi, folder / "planner_client")
    shutil.copy(PROGRAMS / "plan.ts", folder)
    run(folder, "npm", "install", "--no-save", "--no-package-lock", "--silent", TYPESCRIPT, NODE_TYPES)
    run(folder, "npx", "tsc", *TYPESCRIPT_OPTIONS, "--types", "node", "--outDir", "made", "plan.ts")
    return run(folder, "node", "made/plan.js", url)


def java(openapi: Path, folder: Path, url: str) -> str:
    GENERATORS["java"](openapi, folder / "client")
    shutil.copy(PROGRAMS / "Plan.java", folder)
    # The generator's own archive holds Jackson, which a project would get from Maven's repository.
    classes = f"{files('openapi_generator_cli')}/openapi-generator.jar:{ANNOTATIONS}"
    sources = sorted((folder / "client" / "src" / "main").rglob("*.java"))
    run(folder, "javac", "-nowarn", "-d", "made", "-cp", classes, *sources, "Plan.java")
    return run(folder, "java", "-cp", f"made:{classes}", "Plan", url)


def go(openapi: Path, folder: Path, url: str) -> str:
    GENERATORS["go"](openapi, folder / "client")
    shutil.copy(PROGRAMS / "plan.go", folder)
    (folder / "go.mod").write_text(GO_MODULE, encoding="utf-8")
    run(folder / "client", "gofmt", "-l", ".")
    run(folder, "go", "build", "-o", "plan", ".")
    return run(folder, "./plan", url)


@pytest.mark.parametrize("use", [python, typescript, java, go], ids=list(GENERATORS))
def test_a_client_plans_meets_a_problem_and_runs_a_batch(
    service: RunningService, openapi: Path, tmp_path: Path, use: Callable[[Path, Path, str], str]
) -> None:
    request = plan_request(waypoints=[joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5)], backend={"kind": "quintic"})
    answer = service.post("/v1/trajectories", request).json()
    assert json.loads(use(openapi, tmp_path, service.url)) == {
        "duration": pytest.approx(answer["duration"], rel=1e-12),
        "code": "unknown_robot",
        "lines": 1 + len(answer["samples"]["time"]),
        "batch": ["planned", "unknown_robot"],
    }
