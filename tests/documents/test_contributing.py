"""The operation that docs/contributing.md shows can be added exactly as shown."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.locations import ROOT

PAGE = (ROOT / "docs" / "contributing.md").read_text(encoding="utf-8")


def apply_diff(diff: str, folder: Path) -> None:
    """Replace the lines of each hunk, which must occur exactly once."""
    for name, hunk in re.findall(r"^\+\+\+ b/(.*)\n@@\n((?:[ +-].*\n|\+\n)*?)(?=--- |\Z)", diff, flags=re.MULTILINE):
        lines = hunk.splitlines()
        before, after = ("\n".join(line[1:] for line in lines if line[:1] != sign) for sign in "+-")
        file = folder / name
        content = file.read_text(encoding="utf-8")
        assert content.count(before) == 1, name
        file.write_text(content.replace(before, after), encoding="utf-8")


@pytest.mark.large_only
def test_the_worked_example_adds_an_operation(tmp_path: Path) -> None:
    """In two files, and with an example of its body it stands in the document and a worker runs it."""
    (diff,) = re.findall(r"```diff\n(.*?)```", PAGE, flags=re.DOTALL)
    for package in ("api", "clients"):
        ignored = shutil.ignore_patterns("built_page", "__pycache__")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignored)
    apply_diff(diff, tmp_path)
    examples = tmp_path / "api/contract/examples/request_examples.json"
    bodies = json.loads(examples.read_text())
    examples.write_text(json.dumps(bodies | {"gravity": bodies["inverse_dynamics"]}))
    program = """
import json, math
from api.pool.messages import Caps, Task
from api.contract.examples.request_examples import request_examples
from api.work.execution import execute
from clients.document import openapi_document

operation = openapi_document(1000)["paths"]["/v1/dynamics/gravity"]["post"]
body = json.dumps(request_examples()["gravity"]["holding_a_payload"]).encode()
tasks = [Task(name, "", 0.0, math.inf, body, {}) for name in ("gravity", "inverse_dynamics")]
replies = [execute(task, Caps(60.0, 10, 2000, 1024)) for task in tasks]
assert replies[0].status == 200, replies[0].body
assert replies[0].body == replies[1].body
print(operation["operationId"], *operation["responses"])
"""
    ran = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={"PYTHONPATH": f"{tmp_path}:{ROOT}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.startswith("gravity 200 400")
