"""The benchmark of roadmaps, with few queries."""

from __future__ import annotations

import pytest

from benchmarks.collisions import roadmaps, stored_roadmaps


def test_it_measures_and_prints(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(roadmaps, "KINDS", ("table_under",))
    figures = roadmaps.measure(("kuka_kr16_2",), 2, samples=30)
    roadmaps.print_table(figures)
    assert "kuka_kr16_2" in capsys.readouterr().out
    for when in ("before", "after"):
        assert figures["arms"]["kuka_kr16_2"][when]["with"]["median"] > 0.0


@pytest.mark.large_only
def test_it_measures_stored_roadmaps_over_http(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(stored_roadmaps, "KINDS", ("table_under",))
    figures = stored_roadmaps.measure(("kuka_kr16_2",), 2, samples=30)
    stored_roadmaps.print_table(figures)
    assert "after a change" in capsys.readouterr().out
    for state in stored_roadmaps.STATES:
        one = figures["arms"]["kuka_kr16_2"][state]
        assert 0.0 < one["plan"]["median"] < one["latency"]["median"]
