"""The benchmark of drill holes, with few holes."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.tasks.holes import by_distance, measure, print_table, tour_length


@pytest.mark.large_only
def test_holes_in_a_block_take_less_time_than_in_the_order_by_distance(capsys: pytest.CaptureFixture[str]) -> None:
    figures = measure("block", 30, 0, "trapezoidal")
    assert figures["saved"] > 0.1
    assert figures["bound"] <= figures["duration"]
    print_table(figures)
    assert f"{figures['duration']:.2f} s" in capsys.readouterr().out


def test_no_reversal_shortens_the_tour_by_distance() -> None:
    points = np.random.default_rng(0).random((12, 3))
    tour = by_distance(points)
    assert sorted(tour) == list(range(12))
    shortest = tour_length(points, tour)
    for first in range(1, 12):
        for last in range(first + 1, 13):
            other = tour[:first] + tour[first:last][::-1] + tour[last:]
            assert tour_length(points, other) >= shortest - 1e-9
