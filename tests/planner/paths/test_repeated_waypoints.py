"""Waypoints at one joint position, or nearly so: a segment of no length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from planner.backends import BACKENDS
from planner.backends.ruckig.ruckig import Ruckig
from planner.backends.splines.cubic import Cubic
from planner.errors import InvalidProblem
from planner.kinematics import forward_kinematics
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    AnyWaypoint,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.robots import load_robot
from planner.spatial import FloatArray, Pose, rotation_from_rpy
from tests.planner.problems_of_tests import backend_of

ROBOT = load_robot("kuka_kr16_2")
HOME = np.array([0.1, -1.2, 1.4, 0.2, 0.6, -0.3])
CORNER = HOME + np.array([0.5, 0.3, -0.3, 0.1, 0.2, 0.2])
GOAL = HOME + np.array([1.0, 0.0, -0.2, 0.1, 0.0, 0.1])
STOP, THROUGH = StopTransition(), ThroughTransition()
APART = (0.0, 1e-15, 1e-10, 3e-9, 1e-6)
"""Distances between waypoints, rad or m: the first three count as one position, the others do not."""
ONE = 1e-9
"""Distance up to which two positions count as one, rad or m."""


def at(q: FloatArray, transition: Transition = STOP, **options: float) -> JointWaypoint:
    return JointWaypoint(position=q, transition=transition, **options)


def moved(x: float, z: float, transition: Transition = STOP, rotation: FloatArray | None = None) -> RelativeWaypoint:
    move = CartesianMove((x, 0.0, z), rotation)
    return RelativeWaypoint(move=move, motion=LinearMotion(), transition=transition)


def pose(q: FloatArray, shift: float, transition: Transition = STOP) -> PoseWaypoint:
    (here,) = forward_kinematics(ROBOT, [q])
    return PoseWaypoint(pose=Pose(here.position + np.array([shift, 0.0, 0.0]), here.rotation), transition=transition)


def lists(apart: float) -> dict[str, list[AnyWaypoint]]:
    """Return lists with a repeated waypoint, `apart` from itself in each joint or in position."""
    beside = CORNER + apart * np.resize([1.0, -1.0], 6)
    blend = BlendTransition(0.02)
    return {
        "stop": [at(HOME), at(CORNER), at(beside), at(GOAL)],
        "start": [at(CORNER), at(beside), at(GOAL)],
        "end": [at(HOME), at(CORNER), at(beside)],
        "through": [at(HOME), at(CORNER, THROUGH), at(beside, THROUGH), at(GOAL)],
        "blend": [at(HOME), at(CORNER, blend), at(beside, BlendTransition(0.03)), at(GOAL)],
        "pose": [at(HOME), pose(CORNER, 0.0), pose(CORNER, apart), at(GOAL)],
        "pose through": [at(HOME), pose(CORNER, 0.0, THROUGH), pose(CORNER, apart, THROUGH), at(GOAL)],
        "line": [at(HOME), moved(0.0, -0.05), moved(0.0, -apart), moved(0.05, 0.0)],
        "line blended": [at(HOME), moved(0.0, -0.05, blend), moved(0.0, -apart, blend), moved(0.05, 0.0)],
    }


@dataclass(frozen=True)
class Twice:
    """A plan of a list with a repeated waypoint, and of the list without it."""

    repeated: Plan
    once: Plan


def planned(name: str, apart: float, kind: str) -> Twice:
    waypoints = lists(apart)[name]
    index = 1 if name == "start" else 2
    once = [*waypoints[:index], *waypoints[index + 1 :]]
    return Twice(*(plan(PlanningProblem(ROBOT, ways), backend_of(kind)) for ways in (waypoints, once)))


KINDS = [kind for kind in BACKENDS if kind != "min_effort"]


@pytest.mark.long_table
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("apart", APART)
@pytest.mark.parametrize("name", lists(0.0))
def test_a_waypoint_given_twice_is_planned(name: str, apart: float, kind: str) -> None:
    both = planned(name, apart, kind)
    found = both.repeated.trajectory
    index = 1 if name == "start" else 2
    assert (np.diff(found.breakpoints) > 0.0).all()
    assert (np.diff(found.arrivals) >= 0.0).all()
    one = apart < ONE
    assert [w.code for w in both.repeated.warnings if w.code == "waypoint_repeated"] == ["waypoint_repeated"] * one
    if one:
        assert found.duration == pytest.approx(both.once.trajectory.duration, rel=1e-6)
        assert found.arrivals[index] == found.departures[index - 1]
        assert index - 1 not in found.segments
    else:  # at most a stop at both
        stopping = [replace(waypoint, transition=STOP) for waypoint in both.repeated.problem.waypoints]
        stops = plan(PlanningProblem(ROBOT, stopping), Cubic()).trajectory.duration
        assert found.duration <= 2.0 * stops + 0.1


@pytest.mark.parametrize("name", ["stop", "through", "line"])
def test_min_effort_plans_a_waypoint_given_twice(name: str) -> None:
    both = planned(name, 0.0, "min_effort")
    assert both.repeated.trajectory.duration == pytest.approx(both.once.trajectory.duration, rel=1e-6)


@pytest.mark.parametrize("kind", BACKENDS)
@pytest.mark.parametrize(
    ("waypoints", "duration"),
    [
        ([at(HOME)], 0.01),
        ([at(HOME, dwell=2.0)], 2.0),
        ([at(HOME), at(HOME), at(HOME)], 0.01),
        ([at(HOME), at(HOME, duration=3.0)], 3.0),
        ([at(HOME, dwell=0.5), at(HOME, duration=3.0), at(HOME, dwell=1.0)], 4.5),
        ([at(HOME), moved(0.0, 0.0), pose(HOME, 0.0)], 0.01),
    ],
)
def test_a_list_that_goes_nowhere_is_a_rest(kind: str, waypoints: Sequence[AnyWaypoint], duration: float) -> None:
    found = plan(PlanningProblem(ROBOT, waypoints), backend_of(kind))
    assert found.trajectory.duration == duration
    position, velocity = found.trajectory.evaluate(found.trajectory.sample_times(0.003), (0, 1))
    assert np.abs(position - HOME).max() <= ONE
    assert not velocity.any()
    assert len(found.trajectory.arrivals) == len(waypoints)


def test_a_duration_and_dwells_at_a_repeated_waypoint_are_rests() -> None:
    waypoints = [at(HOME), at(CORNER, dwell=1.0), at(CORNER, duration=2.0, dwell=0.5), at(GOAL)]
    found = plan(PlanningProblem(ROBOT, waypoints)).trajectory
    once = plan(PlanningProblem(ROBOT, [at(HOME), at(CORNER), at(GOAL)])).trajectory
    arrival = once.arrivals[1]
    assert found.arrivals == pytest.approx([0.0, arrival, arrival + 3.0, once.duration + 3.5])
    assert found.departures == pytest.approx([0.0, arrival + 1.0, arrival + 3.5, once.duration + 3.5])
    assert np.ptp(found.evaluate(np.linspace(arrival, arrival + 3.5, 50), [0])[0], axis=0).max() < 1e-12


def test_a_duration_between_passed_waypoints_at_one_position_makes_the_robot_stop() -> None:
    waypoints = [at(HOME), at(CORNER, THROUGH), at(CORNER, THROUGH, duration=2.0), at(GOAL)]
    found = plan(PlanningProblem(ROBOT, waypoints)).trajectory
    assert found.arrivals[2] - found.arrivals[1] == pytest.approx(2.0)
    assert not found.evaluate(found.arrivals[1] + 1.0, [1])[0].any()


def test_the_strictest_transition_of_a_repeated_waypoint_holds() -> None:
    blend = BlendTransition(0.05)
    for pair, passed, met in (
        ((blend, THROUGH), True, True),
        ((blend, STOP), False, True),
        ((blend, blend), True, False),
    ):
        waypoints = [at(HOME), at(CORNER, pair[0]), at(CORNER, pair[1]), at(GOAL)]
        found = plan(PlanningProblem(ROBOT, waypoints)).trajectory
        position, velocity = found.evaluate(found.arrivals[1], (0, 1))
        assert (np.abs(velocity).max() > 1e-3) == passed
        assert (np.abs(position - CORNER).max() < 1e-9) == met


def test_a_turn_of_the_tool_in_place_is_a_motion() -> None:
    turn = rotation_from_rpy(0.0, 0.0, 0.5)
    found = plan(PlanningProblem(ROBOT, [at(HOME), moved(0.0, 0.0, rotation=turn)]))
    assert not found.warnings
    start, end = forward_kinematics(ROBOT, found.trajectory.evaluate([0.0, found.trajectory.duration], [0])[0])
    assert np.allclose(start.position, end.position, atol=1e-6)
    assert np.allclose(start.rotation.T @ end.rotation, turn, atol=1e-6)


def test_a_line_of_no_length_out_of_a_stretched_wrist() -> None:
    """The arm need not be able to move the tool along a line of zero length."""
    stretched = np.array([0.3, -1.2, 1.4, 0.0, 0.0, 0.0])
    found = plan(PlanningProblem(ROBOT, [at(stretched), moved(0.0, 0.0), at(GOAL)]))
    assert [warning.code for warning in found.warnings] == ["waypoint_repeated"]


def test_waypoints_do_not_creep_away_together() -> None:
    """Each is near the one before, but only the first few are one position."""
    waypoints = [at(HOME), *(at(CORNER + k * 0.9e-9, THROUGH) for k in range(20)), at(GOAL)]
    found = plan(PlanningProblem(ROBOT, waypoints)).trajectory
    met = found.evaluate(found.arrivals, [0])[0]
    assert np.abs(met - [waypoint.position for waypoint in waypoints]).max() <= 1.01e-9


def test_motion_at_the_ends_where_nothing_moves_is_refused() -> None:
    with pytest.raises(InvalidProblem, match="rests there"):
        plan(PlanningProblem(ROBOT, [at(HOME), at(HOME)]), Ruckig(initial_velocity=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0)))


def test_motion_at_the_ends_of_a_list_with_repeats() -> None:
    backend = Ruckig(initial_velocity=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), final_velocity=(0.0, 0.1, 0.0, 0.0, 0.0, 0.0))
    repeated = plan(PlanningProblem(ROBOT, [at(HOME), at(HOME), at(GOAL), at(GOAL)]), backend).trajectory
    once = plan(PlanningProblem(ROBOT, [at(HOME), at(GOAL)]), backend).trajectory
    assert repeated.duration == once.duration
    assert repeated.evaluate(0.0, [1])[0][0] == pytest.approx(0.1)
