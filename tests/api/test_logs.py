"""The log: one JSON object a line, without paths of the host."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from api.failures import where_from
from tests.locations import ROOT

WARNS = """
from api.logs import configure_logs
configure_logs("info")
import numpy as np
np.array([1.0]) / np.array([0.0])
"""


def test_warnings_of_numpy_are_lines_of_the_log_without_paths() -> None:
    """As workers log them: numpy's warnings came as plain text with the path of the file."""
    ran = subprocess.run([sys.executable, "-c", WARNS], cwd=ROOT, check=True, capture_output=True, text=True)
    [line] = ran.stderr.splitlines()
    logged = json.loads(line)
    assert (logged["event"], logged["level"], logged["category"]) == ("library_warning", "warning", "RuntimeWarning")
    assert "divide by zero" in logged["message"]
    assert "/" not in logged["where"]
    assert ran.stdout == ""


def test_a_failure_is_told_without_paths_and_values() -> None:
    with pytest.raises(json.JSONDecodeError) as caught:
        json.loads("a caller's value")
    told = where_from(caught.value)
    assert told.startswith("JSONDecodeError < raw_decode (decoder.py:")
    assert "/" not in told
    assert "caller" not in told
