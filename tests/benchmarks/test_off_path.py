"""The benchmark of optimised durations, with one short search."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from benchmarks.trajectories.off_path import measure, print_table

if TYPE_CHECKING:
    from _pytest.capture import CaptureFixture


@pytest.mark.large_only
def test_it_measures_and_prints(capsys: CaptureFixture[str]) -> None:
    figures = measure(1, 2, 0.1, 0.3)
    print_table(figures)
    assert "within 1.05 of the best" in capsys.readouterr().out
    (row,) = figures["rows"]
    assert row["last"] <= row["first"]
    assert len(row["searches"]) == 2
