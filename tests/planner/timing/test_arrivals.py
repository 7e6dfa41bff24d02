"""Time windows at waypoints: arrivals are as a recursion over free durations says, and late ones are refused."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import planner
from planner.spatial import FloatArray
from planner.timing.arrivals import with_wait

ROBOT = planner.load_robot("ur5e")
HOME = [0.8, -1.2, 1.4, -1.77, -1.57, 0.0]
AWAY = [-0.8, -1.2, 1.4, -1.77, -1.57, 0.0]
ONCE = planner.Budget(attempts=1)


def at(position: Any, **more: Any) -> planner.JointWaypoint:
    """Return a waypoint at a joint position."""
    return planner.JointWaypoint(position, **more)


def made(waypoints: Any, backend: Any = "cubic", **more: Any) -> planner.Plan:
    """Plan without remedies."""
    return planner.plan(planner.PlanningProblem(ROBOT, waypoints, **more), backend, ONCE)


def expected_arrivals(free: planner.Plan, waypoints: list[planner.JointWaypoint]) -> FloatArray:
    """Return the least arrivals (waypoints,), s, of stops: each as soon as it is reached, and open."""
    durations = free.trajectory.arrivals[1:] - free.trajectory.departures[:-1]
    arrivals = [0.0]
    for (before, waypoint), duration in zip(pairwise(waypoints), durations.tolist(), strict=True):
        arrivals.append(max(waypoint.earliest_arrival, arrivals[-1] + before.dwell + duration))
    return np.array(arrivals)


@pytest.mark.parametrize("backend", ["cubic", "trapezoidal", "ruckig", "toppra"])
def test_arrivals_are_the_least_within_the_windows(backend: str) -> None:
    rng = np.random.default_rng(7)
    for _ in range(3):
        positions = rng.uniform(-1.0, 1.0, (5, 6)) * 0.5 + HOME
        plain = [at(position, dwell=float(rng.choice([0.0, 0.3]))) for position in positions]
        free = made(plain, backend)
        opened = np.sort(rng.uniform(0.0, 2.0 * free.trajectory.duration, 5)) * (rng.random(5) < 0.6)
        windows = [
            plain[0],
            *(replace(w, earliest_arrival=float(t)) for w, t in zip(plain[1:], opened[1:], strict=True)),
        ]
        expected = expected_arrivals(free, windows)
        closed = [windows[0], *(replace(w, latest_arrival=t) for w, t in zip(windows[1:], expected[1:], strict=True))]
        plan = made(closed, backend)
        np.testing.assert_allclose(plan.trajectory.arrivals, expected, atol=1e-9)
        np.testing.assert_allclose(plan.trajectory.at_arrivals, positions, atol=1e-9)
        assert plan.certificate.satisfied
        assert any(check.quantity == "duration_error" for check in plan.certificate.checks)
        late = int(rng.integers(1, 5))
        closed[late] = replace(windows[late], earliest_arrival=0.0, latest_arrival=expected[late] - 1e-3)
        if windows[late].earliest_arrival:
            continue
        with pytest.raises(planner.InfeasibleDuration) as refused:
            made(closed, backend)
        assert refused.value.waypoint == late
        assert refused.value.limit == pytest.approx(expected[late])


def test_a_passed_waypoint_is_reached_on_time_by_a_wait_at_the_stop_before() -> None:
    middle = np.add(HOME, AWAY) / 2.0 + [0.0, 0.2, 0.0, 0.0, 0.0, 0.0]
    passing = at(middle, transition=planner.ThroughTransition())
    free = made([at(AWAY), at(HOME), passing, at(AWAY)]).trajectory
    plan = made([at(AWAY), at(HOME), replace(passing, earliest_arrival=3.0), at(AWAY)])
    wait = 3.0 - free.arrivals[2]
    np.testing.assert_allclose(plan.trajectory.arrivals, free.arrivals + wait * np.array([0, 0, 1, 1]), atol=1e-9)
    assert plan.problem.waypoints[1].dwell == pytest.approx(wait)
    before, after = (
        t.evaluate(np.linspace(0.0, 0.8, 50) + t.departures[1], [0, 1])[0] for t in (free, plan.trajectory)
    )
    np.testing.assert_allclose(before, after, atol=1e-9)


@pytest.mark.parametrize("backend", ["trapezoidal", "toppra", pytest.param("ruckig", marks=pytest.mark.large_only)])
def test_segments_take_longer_where_a_wait_would_make_a_passed_waypoint_late(backend: str) -> None:
    passed = [np.add(HOME, turn) for turn in ([-0.5, 0.2, 0.0, 0.0, 0.0, 0.0], [-1.1, 0.1, 0.2, 0.0, 0.0, 0.0])]
    first, second = (at(position, transition=planner.ThroughTransition()) for position in passed)
    free = made([at(HOME), first, second, at(AWAY), at(HOME)], backend).trajectory
    latest, earliest = float(free.arrivals[1]) + 0.1, float(free.arrivals[2]) + 1.5
    late, soon = replace(first, latest_arrival=latest), replace(second, earliest_arrival=earliest)
    last = at(HOME, earliest_arrival=6.0)
    plan = made([at(HOME), late, soon, at(AWAY, latest_arrival=earliest + 0.9), last], backend).trajectory
    np.testing.assert_allclose(plan.at_arrivals, free.at_arrivals, atol=1e-9)
    assert plan.arrivals[1] <= latest * (1.0 + 1e-9)
    assert earliest - 1e-9 <= plan.arrivals[2] <= earliest + 1e-2
    assert plan.arrivals[4] == pytest.approx(6.0)
    # The robot passes both waypoints in motion, on the same path, within the limits.
    assert np.abs(plan.evaluate(plan.arrivals[1:3], [1])[0]).max(axis=1).min() > 0.5
    times = np.linspace(0.0, plan.arrivals[3], 400)
    found, known = plan.evaluate(times, [0])[0], free.evaluate(np.linspace(0.0, free.arrivals[3], 4000), [0])[0]
    assert max(np.abs(known - q).max(axis=1).min() for q in found) < 2e-3
    for k, limit in enumerate(("velocity", "acceleration"), 1):
        assert (np.abs(plan.evaluate(times, [k])[0]) <= ROBOT.limit(limit) * (1.0 + 1e-6)).all()
    # A wait alone would be late, and no slower segment makes the first waypoint sooner.
    assert earliest - free.arrivals[2] > latest - free.arrivals[1]
    with pytest.raises(planner.InfeasibleDuration) as refused:
        made([at(HOME), replace(late, latest_arrival=float(free.arrivals[1]) - 0.01), soon, at(AWAY)], backend)
    assert refused.value.waypoint == 1


def test_shaped_motions_arrive_on_time_without_more_waiting_than_needed() -> None:
    mode = planner.ResidualVibration(5.0, 0.05, 0.1)
    free = made([at(HOME), at(AWAY)], residual_vibration=mode).trajectory
    plan = made([at(HOME), at(AWAY, earliest_arrival=free.duration + 0.5)], residual_vibration=mode)
    assert plan.trajectory.duration == pytest.approx(free.duration + 0.5)
    assert plan.problem.waypoints[0].dwell == pytest.approx(0.5)


def test_late_arrivals_are_refused_with_arrivals_that_work() -> None:
    problem = planner.PlanningProblem(ROBOT, [at(HOME), at(AWAY, latest_arrival=0.5), at(HOME, latest_arrival=1.2)])
    with pytest.raises(planner.InfeasibleDuration, match=r"waypoint 1 cannot be reached by 0.5 s") as refused:
        planner.plan(problem)
    fields = [remedy.field for remedy in refused.value.remedies]
    assert fields == [("waypoints", 1, "latest_arrival"), ("waypoints", 2, "latest_arrival")]
    for remedy in refused.value.remedies:
        problem = remedy.applied_to(problem)
    assert planner.plan(problem).trajectory.duration == pytest.approx(refused.value.remedies[0].duration)


def test_waits_for_an_arrival_and_for_a_moving_object_add_up() -> None:
    crossing = planner.forward_kinematics(ROBOT, [0.0, *HOME[1:]]).position
    velocity = np.array([0.0, 0.4, 0.0])
    pose = planner.Pose(crossing - 2.4 * velocity)
    crate = planner.SceneObject("crate", [planner.Box([0.1] * 3)], pose, motion=planner.ConstantVelocity(velocity))
    waypoints = [at(HOME), at(AWAY, earliest_arrival=2.8)]
    problem = planner.PlanningProblem(ROBOT, waypoints, scene=planner.Scene([crate]))
    with pytest.raises(planner.Collision) as refused:
        planner.plan(problem, budget=planner.Budget(attempts=8))
    wait = refused.value.remedies[0]
    assert wait.field == ("waypoints", 0, "dwell")
    plan = planner.plan(wait.applied_to(problem), budget=ONCE)
    assert plan.trajectory.arrivals[1] > 2.8
    late = replace(problem, waypoints=[waypoints[0], replace(waypoints[1], latest_arrival=2.9)])
    with pytest.raises(planner.Collision) as refused:
        planner.plan(late, budget=planner.Budget(attempts=8))
    assert all(remedy.field[-1] != "dwell" for remedy in refused.value.remedies)


def test_a_robot_that_starts_in_motion_does_not_wait() -> None:
    moving = planner.Ruckig(initial_velocity=[-0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(planner.InvalidProblem) as refused:
        made([at(HOME), at(AWAY, earliest_arrival=5.0)], moving)
    assert [fault.field for fault in refused.value.faults] == [("waypoints", 1, "earliest_arrival")]


@pytest.mark.parametrize(
    ("waypoints", "more", "field"),
    [
        ([at(HOME, earliest_arrival=1.0), at(AWAY)], {}, (0, "earliest_arrival")),
        ([at(HOME, latest_arrival=1.0), at(AWAY)], {}, (0, "latest_arrival")),
        ([at(HOME), at(AWAY, earliest_arrival=-1.0)], {}, (1, "earliest_arrival")),
        ([at(HOME), at(AWAY, earliest_arrival=np.inf)], {}, (1, "earliest_arrival")),
        ([at(HOME), at(AWAY, latest_arrival=0.0)], {}, (1, "latest_arrival")),
        ([at(HOME), at(AWAY, latest_arrival=np.nan)], {}, (1, "latest_arrival")),
        ([at(HOME), at(AWAY, earliest_arrival=2.0, latest_arrival=1.0)], {}, (1, "latest_arrival")),
        ([at(HOME), at(AWAY, earliest_arrival=2.0)], {"duration": 3.0}, (1, "earliest_arrival")),
    ],
)
def test_windows_that_are_none_are_refused(waypoints: Any, more: dict[str, Any], field: tuple[int, str]) -> None:
    with pytest.raises(planner.InvalidProblem) as refused:
        made(waypoints, **more)
    assert ("waypoints", *field) in [fault.field for fault in refused.value.faults]


def test_a_duration_of_the_whole_may_have_latest_arrivals() -> None:
    problem = planner.PlanningProblem(ROBOT, [at(HOME), at(AWAY, latest_arrival=1.5), at(HOME)], duration=2.8)
    assert planner.plan(problem).trajectory.arrivals[1] <= 1.5
    with pytest.raises(planner.InfeasibleDuration):
        planner.plan(replace(problem, duration=3.2), budget=ONCE)


def test_the_certificate_checks_windows_of_any_trajectory() -> None:
    from planner.certificate.durations import certify_durations

    plan = made([at(HOME), at(AWAY), at(HOME)])
    late = with_wait(plan.trajectory, 1, 0.25)
    for window, excess in (
        ({"latest_arrival": 1.0}, late.arrivals[2] - 1.0),
        ({"earliest_arrival": 9.0}, 9.0 - late.arrivals[2]),
    ):
        (check,) = certify_durations(late, [at(HOME), at(AWAY), at(HOME, **window)], None)
        assert check.peak == pytest.approx(excess)
        assert not check.satisfied


def test_tasks_in_any_order_have_no_windows() -> None:
    tasks = [planner.Task([at(AWAY, latest_arrival=9.0)])]
    with pytest.raises(planner.InvalidProblem) as refused:
        planner.order_tasks(planner.PlanningProblem(ROBOT, [at(HOME)]), tasks)
    assert [fault.field for fault in refused.value.faults] == [("tasks", 0, "waypoints", 0, "latest_arrival")]
