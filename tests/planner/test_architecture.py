"""The modules that a worker loads; `python -m tests.lint` checks the imports of files."""

from __future__ import annotations

import subprocess
import sys

from tests.locations import ROOT


def test_a_worker_stays_small() -> None:
    """scipy alone would add 60 MB and half a second to every worker, matplotlib more."""
    code = "import sys, planner.planning, planner.export, planner.certificate.samples; print(*sorted(sys.modules))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert not {"scipy", "matplotlib", "toppra", "casadi", "fastapi"} & set(result.stdout.split())
