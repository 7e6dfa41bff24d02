"""The benchmarks of restarts and of a soak, as small as they can be."""

from __future__ import annotations

import pytest

from benchmarks.service import restarts, soak


@pytest.mark.large_only
def test_one_restart_loses_nothing() -> None:
    figures = restarts.measure(1)
    assert figures["answered"] > restarts.CLIENTS
    assert figures["lost"] == figures["unclean"] == 0


@pytest.mark.large_only
def test_a_moment_of_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soak, "SAMPLES", 10)
    figures = soak.measure(8.0)
    assert sum(figures["asked"].values()) > 10
    assert figures["quantities"].keys() == soak.QUANTITIES.keys()
    assert figures["quantities"]["descriptors"]["most"] > 10
    assert figures["quantities"]["workers_mb"]["first"] > 10.0
