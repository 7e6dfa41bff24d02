"""Several rides in one request: each tool path at dense samples, the order of arrivals, and the latest start."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import planner
from planner.certificate.rides import certify_rides
from planner.planning.attempts import Attempt, Planned
from planner.planning.rides.boarded import with_boarding
from planner.planning.rides.boarding import Boarding, Boardings
from planner.planning.rides.search import ARRIVAL_KNOWN_TO
from planner.problems.rides import RideMotion, rides_of
from planner.spatial import Pose
from planner.timing.arrivals import with_wait
from tests.planner.planning.rides.belt import ABOVE, ARM, HOME, ONCE, PLACE, off_part, on, part, pick, problem

UP = planner.RelativeWaypoint(
    planner.CartesianMove(translation=[0.0, 0.0, 0.1]), frame="base", motion=planner.LinearMotion()
)
TWICE = planner.Budget(attempts=2)
"""The budget of one plan up to each of two rides."""

DROP = [planner.JointWaypoint(PLACE, detach=["part"]), UP]


def two(first: Any = (-0.5, -0.9, 0.15), second: Any = (-0.5, -1.5, 0.15)) -> list[planner.SceneObject]:
    """Return two parts on one belt."""
    return [part(first), replace(part(second), id="second")]


def both(
    *, dwell: float = 0.0, first: float = 0.0, earliest: float = 0.0, latest: float | None = None
) -> planner.PlanningProblem:
    """Return the problem of two parts that are picked one after the other."""
    thing, second = two()
    waypoints = [*pick(first), *DROP, *pick(earliest, latest, thing="second")]
    return problem(thing, waypoints, second, home=planner.JointWaypoint(HOME, dwell=dwell), place=HOME)


@cache
def earliest() -> planner.Plan:
    """Return the plan of both rides as early as they can be."""
    return planner.plan(both(), "ruckig")


def test_the_tool_stays_with_two_parts_one_after_the_other() -> None:
    plan = planner.plan(both(first=2.5, earliest=6.5), "ruckig", TWICE)
    assert [(ride.waypoint, ride.object) for ride in plan.rides] == [(1, "part"), (6, "second")]
    assert [ride.arrival for ride in plan.rides] == pytest.approx([2.5, 6.5])
    assert plan.requested_indices == (0, 1, 1, 2, 3, 4, 4, 5, 6, 6, 7, 8, 9, 9)
    checks = {check.quantity: check.peak for check in plan.certificate.checks}
    for thing in two():
        far, turned = off_part(plan, thing)
        assert 0.0 < far <= checks["object_position_deviation"] < 1e-4
        assert turned <= checks["object_orientation_deviation"] < 1e-3
    times = np.linspace(0.0, plan.trajectory.duration, 2000)
    for k, limit in enumerate(("velocity", "acceleration", "jerk"), 1):
        assert (np.abs(plan.trajectory.evaluate(times, [k])[0]) <= ARM.limit(limit) * (1.0 + 1e-9)).all()


@pytest.mark.large_only
def test_rides_are_as_early_as_they_can_and_the_latest_start_works() -> None:
    plan = earliest()
    first, second = plan.rides
    alone = planner.plan(problem(part(), pick()), "ruckig", planner.Budget(attempts=8))
    assert first.arrival == pytest.approx(alone.rides[0].arrival), "the first ride is as early as alone"
    start = first.latest_start
    assert second.latest_start == start > 1.0
    late = planner.plan(both(dwell=start), "ruckig", planner.Budget(attempts=14))
    assert [ride.arrival >= start for ride in late.rides] == [True, True]


@pytest.mark.large_only
def test_no_time_of_a_scan_has_a_sooner_second_ride() -> None:
    plan = earliest()
    first, second = plan.rides
    given = both()
    boardings = Boardings(given, rides_of(given)[0])
    met = boardings.at(first.arrival)
    assert isinstance(met, Boarding)
    after = Boardings(with_boarding(boardings, met), rides_of(with_boarding(boardings, met))[0])
    for time in np.linspace(first.end, second.arrival - 2.0 * ARRIVAL_KNOWN_TO, 4).tolist():
        boarding = after.at(time)
        if isinstance(boarding, Boarding):
            outcome = Attempt(with_boarding(after, boarding), plan.backend).made()
            assert not isinstance(outcome, Planned), f"a ride at {time} s is sooner"


def test_one_part_is_visited_twice_and_the_check_sees_each_ride(tmp_path: Any) -> None:
    thing = part()
    waypoints = [on(ABOVE, earliest_arrival=2.0), PLACE, on(ABOVE, earliest_arrival=4.5)]
    plan = planner.plan(problem(thing, waypoints, place=HOME), "ruckig", TWICE)
    assert [ride.arrival for ride in plan.rides] == pytest.approx([2.0, 4.5])
    assert off_part(plan, thing)[0] <= 1e-4
    plan.save(tmp_path / "rides.plan")
    assert planner.load(tmp_path / "rides.plan").rides == plan.rides
    stop = plan.requested_indices.index(2) + 1  # between the rides
    late = with_wait(plan.trajectory, stop, 2e-3)  # 0.4 mm on the belt, on the second ride only
    (position, _) = certify_rides(late, plan.problem)
    assert position.peak == pytest.approx(4e-4, rel=0.02)
    assert position.time > plan.rides[1].begin
    first = next(k for k, w in enumerate(plan.problem.waypoints) if isinstance(w.motion, RideMotion))
    faster = replace(thing, motion=planner.ConstantVelocity([0.0, 0.21, 0.0]))
    other = list(plan.problem.waypoints)
    other[first] = replace(other[first], motion=replace(other[first].motion, thing=faster))  # type: ignore[call-arg]
    (position, _) = certify_rides(plan.trajectory, replace(plan.problem, waypoints=other))
    assert not position.satisfied, "the first ride is checked, too"


def test_rides_may_follow_each_other_and_actions_keep_their_waypoints() -> None:
    thing, second = two(second=(-0.6, -1.2, 0.15))
    actions = [planner.SetOutput(planner.AtWaypoint(k), f"at {k}", True) for k in range(4)]
    waypoints = [on(ABOVE, earliest_arrival=2.0), on(ABOVE, "second", earliest_arrival=4.5)]
    plan = planner.plan(problem(thing, waypoints, second, actions=actions), "ruckig", TWICE)
    for part_of_belt in (thing, second):
        assert off_part(plan, part_of_belt)[0] <= 1e-4
    times = [action.time for action in plan.actions]
    assert times[1:3] == pytest.approx([ride.arrival for ride in plan.rides])
    assert times[3] == pytest.approx(plan.trajectory.duration)


def test_a_second_ride_that_cannot_be_is_refused_with_its_waypoint() -> None:
    thing, second = two(second=(-0.5, 3.0, 0.15))
    with pytest.raises(planner.UnreachableWaypoint, match="'second' is out of reach"):
        planner.plan(problem(thing, [on(ABOVE, earliest_arrival=2.0), on(ABOVE, "second")], second), "ruckig", ONCE)
    table = planner.SceneObject("part", [planner.Box([0.06] * 3)], Pose([-0.5, -0.2, 0.15]))
    with pytest.raises(planner.InvalidProblem, match="stands still"):
        planner.plan(problem(table, [on(ABOVE, "second"), on(ABOVE)], second), "ruckig")


@pytest.mark.large_only
def test_a_second_ride_that_is_too_late_is_refused_with_the_arrival_that_works() -> None:
    with pytest.raises(planner.InfeasibleDuration) as refusal:
        planner.plan(both(latest=4.2), "ruckig", planner.Budget(attempts=20))
    assert refusal.value.waypoint == 6
    (remedy,) = refusal.value.remedies
    assert remedy.field == ("waypoints", 6, "latest_arrival")
    assert planner.plan(both(latest=remedy.value), "ruckig", planner.Budget(attempts=20)).rides
