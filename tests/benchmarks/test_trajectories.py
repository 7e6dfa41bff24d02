"""The benchmark of trajectories: its judgement of motions known in closed form, and its way from lists to figures."""

from __future__ import annotations

import io
from contextlib import redirect_stdout
from typing import TYPE_CHECKING

import numpy as np
import orjson
import pytest

from benchmarks.trajectories import peers, report, trajectories
from benchmarks.trajectories.peers import Motion
from planner.backends import Quintic, Toppra
from planner.robots import load_robot

if TYPE_CHECKING:
    from pathlib import Path

    from planner.kinematics import FloatArray

ARM = load_robot("kuka_kr16_l6_2")


def swing(amplitude: FloatArray, duration: float) -> Motion:
    """Return one sine period of each joint about zero."""
    w = 2.0 * np.pi / duration

    def sample(times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        t = w * times[:, None]
        return amplitude * np.sin(t), amplitude * w * np.cos(t), -amplitude * w**2 * np.sin(t)

    return Motion(duration, sample)


@pytest.mark.parametrize("off", [0.0, 1e-3])
def test_a_sine_is_judged_as_it_is(off: float) -> None:
    duration = 3.0
    amplitude = np.full(ARM.dof, 0.01)
    w = 2.0 * np.pi / duration
    passed = np.array([0.0, 0.3, 0.8, -0.55])[:, None] * amplitude
    passed[2, 3] += off
    judged = trajectories._judge(trajectories.Case(ARM, passed), lambda _: swing(amplitude, duration))
    for order, quantity in enumerate(trajectories.QUANTITIES, start=1):
        expected = (amplitude * w**order / ARM.limit(quantity)).max()
        assert judged["use"][quantity] == pytest.approx(expected, rel=1e-5)
    # Where all joints move alike, the nearest point is half way to the one that is off; found to a sample's distance.
    assert judged["waypoint_error"] == pytest.approx(off / 2.0, abs=1e-5 if off else 1e-12)
    assert judged["duration"] == duration


@pytest.mark.large_only
def test_two_lists_become_figures(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    ours = {"quintic": Quintic(), "toppra": Toppra()}
    ruckig = "Ruckig, stopping"
    monkeypatch.setattr(trajectories, "OURS", ours)
    monkeypatch.setattr(trajectories, "PEERS", {ruckig: peers.PEERS[ruckig]})
    short = [trajectories.Case(case.robot, case.positions[:4]) for case in trajectories.cases((ARM,), 2)]
    monkeypatch.setattr(trajectories, "cases", lambda _robots, count: short[:count])
    figures = trajectories.measure(2)
    for solvers in figures["transitions"].values():
        assert list(solvers) == ["our quintic", "our toppra", ruckig]
        for row in solvers.values():
            assert (row["asked"], row["refused"], row["over_limit"]) == (2, 0, 0)
            assert row["waypoint_error"] < 1e-9
        assert solvers["our toppra"]["duration_ratio"]["most"] == 1.0
        assert solvers["our quintic"]["duration_ratio"]["least"] > 1.0
    with redirect_stdout(io.StringIO()) as out:
        report.print_json(figures)
    assert orjson.loads(out.getvalue())["lists"] == 2
    with redirect_stdout(io.StringIO()) as out:
        report.print_table(figures)
    assert out.getvalue().count(ruckig[:6]) == 2
    report.draw(figures, tmp_path / "plot.png")
    assert (tmp_path / "plot.png").stat().st_size > 1000


def test_the_lists_are_always_the_same_and_within_the_range() -> None:
    lists = trajectories.cases((ARM,), 200)
    counts = [len(case.positions) for case in lists]
    assert min(counts) == 2
    assert 45 <= max(counts) <= 50
    for case, again in zip(lists, trajectories.cases((ARM,), 5), strict=False):
        np.testing.assert_array_equal(case.positions, again.positions)
    assert all(((case.positions > ARM.limit("lower")) & (case.positions < ARM.limit("upper"))).all() for case in lists)
