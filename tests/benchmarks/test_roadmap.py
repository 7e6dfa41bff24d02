"""The benchmark of roadmaps, with few queries."""

from __future__ import annotations

import pytest

from benchmarks.collisions import roadmaps


def test_it_measures_and_prints(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(roadmaps, "KINDS", ("table_under",))
    figures = roadmaps.measure(("kuka_kr16_2",), 2, samples=30)
    roadmaps.print_table(figures)
    assert "kuka_kr16_2" in capsys.readouterr().out
    for when in ("before", "after"):
        assert figures["arms"]["kuka_kr16_2"][when]["with"]["median"] > 0.0
