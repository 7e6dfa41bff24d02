"""The service needs nothing from outside: it plans, works on batches and serves its pages without a network."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.locations import ROOT

WITHOUT_NETWORK = ["unshare", "--map-root-user", "--net"]


@pytest.mark.large_only
def test_everything_works_without_a_network() -> None:
    if subprocess.run([*WITHOUT_NETWORK, "true"], check=False, capture_output=True).returncode:
        pytest.skip("this system lets nobody make network namespaces")
    command = [*WITHOUT_NETWORK, sys.executable, "-m", "tests.api.isolated"]
    run = subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    seen = json.loads(run.stdout)
    assert seen["interfaces"][0] == "lo" and not {"eth0", "docker0"} & set(seen["interfaces"])
    assert seen["plan"] == 200 and seen["batch"] == ["planned"] * 5 and seen["same"]
    assert set(seen["pages"].values()) == {200}
    assert seen["elsewhere"] == []
    assert len(seen["files"]) >= 3 and set(seen["files"].values()) == {200}
