"""Durations of whole trajectories, and least durations of segments: the fastest plan, slowed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from planner.backends import BACKENDS, Ruckig, Toppra, Trapezoidal
from planner.errors import InfeasibleDuration, InvalidProblem, LimitsUnsatisfiable
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.robots import load_robot
from planner.spatial import Pose
from tests.planner.problems_of_tests import backend_of

ROBOT = load_robot("kuka_kr16_2")
POSITIONS = (
    (0.0, -1.5, 1.5, 0.0, 0.5, 0.0),
    (1.0, -1.2, 1.2, 0.0, 0.5, 0.5),
    (1.3, -1.0, 1.3, 0.3, 0.5, 0.5),
    (0.3, -1.0, 1.1, 0.3, 0.5, 0.0),
)
STOP, THROUGH = StopTransition(), ThroughTransition()
EVENLY = ["cubic", "quintic", "trapezoidal", "ruckig", "toppra"]
"""The back ends that make the same motion in a longer duration."""

QUICK = [*EVENLY, "auto"]
"""All except the searching back end, which random problems try."""


def problem_with(passed: Transition = STOP, **changes: object) -> PlanningProblem:
    """Return four waypoints with a dwell at the first, and changes of the third."""
    waypoints = [JointWaypoint(position, transition=passed) for position in POSITIONS]
    waypoints[0] = replace(waypoints[0], transition=STOP, dwell=0.2)
    waypoints[2] = replace(waypoints[2], **changes)  # type: ignore[arg-type] # of any field
    waypoints[3] = replace(waypoints[3], transition=STOP)
    return PlanningProblem(ROBOT, waypoints)


def times_of(result: Plan) -> np.ndarray:
    times: np.ndarray = result.trajectory.arrivals[1:] - result.trajectory.departures[:-1]
    return times


def worst(result: Plan) -> dict[str, float]:
    return {check.quantity: check.ratio for check in result.certificate.checks if check.ratio is not None}


@pytest.fixture(scope="module", params=[STOP, THROUGH], ids=["stop", "through"])
def passed(request: pytest.FixtureRequest) -> Iterator[Transition]:
    yield request.param


@pytest.mark.parametrize("kind", EVENLY)
def test_the_whole_takes_so_long_and_is_the_fastest_plan_slower(kind: str, passed: Transition) -> None:
    problem, backend = problem_with(passed), BACKENDS[kind]()
    fastest = plan(problem, backend)
    whole = plan(replace(problem, duration=4.0), backend)
    factor = (4.0 - 0.2) / (fastest.trajectory.duration - 0.2)
    assert whole.trajectory.duration == whole.trajectory.arrivals[-1] == 4.0
    np.testing.assert_allclose(times_of(whole), factor * times_of(fastest))
    at = np.linspace(0.2, 4.0, 50)
    (slower,) = whole.trajectory.evaluate(at, [0])
    (faster,) = fastest.trajectory.evaluate(np.minimum(0.2 + (at - 0.2) / factor, fastest.trajectory.duration), [0])
    np.testing.assert_allclose(slower, faster, atol=1e-9)
    for power, quantity in enumerate(("velocity", "acceleration"), 1):
        assert worst(whole)[quantity] == pytest.approx(worst(fastest)[quantity] / factor**power)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
def test_the_whole_of_one_segment_is_the_segments_own_duration(kind: str) -> None:
    start, end = JointWaypoint(POSITIONS[0], dwell=0.5), JointWaypoint(POSITIONS[1])
    whole = plan(PlanningProblem(ROBOT, [start, end], duration=2.5), backend_of(kind)).trajectory
    own = plan(PlanningProblem(ROBOT, [start, replace(end, duration=2.0)]), backend_of(kind)).trajectory
    at = np.linspace(0.0, 2.5, 40)
    for one, other in zip(whole.evaluate(at), own.evaluate(at), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", EVENLY)
def test_a_whole_that_is_too_short_is_refused_with_the_least_one(kind: str, passed: Transition) -> None:
    backend = BACKENDS[kind]()
    least = plan(problem_with(passed), backend).trajectory.duration
    problem = replace(problem_with(passed), duration=0.999 * least)
    with pytest.raises(InfeasibleDuration) as refusal:
        plan(problem, backend)
    (remedy,) = [remedy for remedy in refusal.value.remedies if remedy.field == ("duration",)]
    assert remedy.value == refusal.value.limit == pytest.approx(least, rel=1e-9)
    assert plan(remedy.applied_to(problem), backend).trajectory.duration == remedy.value


def test_durations_of_segments_are_kept_and_the_others_share_the_rest() -> None:
    problem = replace(problem_with(duration=3.0), duration=7.0)
    durations = times_of(plan(problem))
    assert durations[1] == pytest.approx(3.0, rel=1e-12)
    assert durations.sum() == pytest.approx(7.0 - 0.2)
    free = times_of(plan(problem_with(duration=3.0)))
    assert durations[0] / durations[2] == pytest.approx(free[0] / free[2])


@pytest.mark.parametrize("kind", ["quintic", "ruckig"])
def test_a_duration_is_kept_inside_of_what_is_passed_without_stopping(kind: str) -> None:
    problem = replace(problem_with(THROUGH, duration=1.5), duration=6.0)
    result = plan(problem, BACKENDS[kind]())
    assert result.trajectory.duration == pytest.approx(6.0, rel=1e-12)
    assert times_of(result)[1] == pytest.approx(1.5, rel=1e-9)


@pytest.mark.parametrize("kind", QUICK)
def test_a_least_duration_is_kept_and_no_other_segment_waits_for_it(kind: str) -> None:
    backend = BACKENDS[kind]()
    free, held = (times_of(plan(problem_with(minimum_duration=least), backend)) for least in (0.0, 1.7))
    assert held == pytest.approx([free[0], 1.7, free[2]])
    assert times_of(plan(problem_with(minimum_duration=0.9 * free[1]), backend)) == pytest.approx(free)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", QUICK)
def test_a_least_duration_of_what_is_passed_without_stopping(kind: str) -> None:
    """The other segments are not stretched with it: that would take three times as long."""
    backend = BACKENDS[kind]()
    held = times_of(plan(problem_with(THROUGH, minimum_duration=1.7), backend))
    free = times_of(plan(problem_with(THROUGH), backend))
    assert held[1] >= 1.7 * (1.0 - 1e-9)
    assert held.sum() <= 1.7 + 2.0 * (free[0] + free[2])


@pytest.mark.long_table
@pytest.mark.parametrize(("segment", "seconds"), [(0, 1.7), (1, 1.7), (2, 1.7), (1, 0.9)])
@pytest.mark.parametrize("kind", ["trapezoidal", "toppra"])
def test_only_the_segment_with_a_least_duration_is_slowed_on_the_path(kind: str, segment: int, seconds: float) -> None:
    """The other segments keep their durations. Lower velocity limits made the whole 50 % longer."""
    backend, problem = BACKENDS[kind](), problem_with(THROUGH)
    waypoints = list(problem.waypoints)
    waypoints[segment + 1] = replace(waypoints[segment + 1], minimum_duration=seconds)
    free, held = (plan(own, backend) for own in (problem, replace(problem, waypoints=waypoints)))
    assert held.certificate.satisfied
    assert times_of(held)[segment] >= seconds * (1.0 - 1e-9)
    least = times_of(free).sum() - times_of(free)[segment] + seconds
    assert least * (1.0 - 1e-6) <= times_of(held).sum() <= 1.03 * least


@pytest.mark.large_only
def test_least_durations_along_a_blended_corner() -> None:
    start = (0.3, -1.2, 1.4, 0.2, 0.6, 0.1)
    pose = plan(PlanningProblem(ROBOT, [JointWaypoint(start)])).path.waypoints[0].pose
    aside, down = (Pose(pose.position + np.array(step), pose.rotation) for step in ([0, -0.2, 0], [0, -0.2, -0.2]))
    corner = PoseWaypoint(aside, motion=LinearMotion(), transition=BlendTransition(0.05), minimum_duration=2.0)
    problem = PlanningProblem(ROBOT, [JointWaypoint(start), corner, PoseWaypoint(down, motion=LinearMotion())])
    for backend in (Toppra(), Trapezoidal()):
        durations = times_of(plan(problem, backend))
        assert 2.0 * (1.0 - 1e-9) <= durations[0] < 2.1
        assert durations[1] < 1.5
        whole = times_of(plan(replace(problem, duration=9.0), backend))
        assert whole == pytest.approx(9.0 / durations.sum() * durations)


def test_given_ramps_stay_as_they_are() -> None:
    backend = Trapezoidal(acceleration_time=0.5, deceleration_time=0.8)
    result = plan(replace(problem_with(), duration=12.0), backend).trajectory
    for start, end in zip(result.departures[:-1], result.arrivals[1:], strict=True):
        acceleration = result.evaluate(np.array([0.25, 0.75]) * [1, 0] + start + [0.0, 0.75], [2])[0]
        assert np.abs(acceleration[0]).max() > 0.0
        assert np.abs(acceleration[1]).max() == pytest.approx(0.0, abs=1e-12)
        assert np.abs(result.evaluate(end - 0.4, [2])[0]).max() > 0.0
    assert result.duration == pytest.approx(12.0)


def test_motion_at_the_ends_is_kept() -> None:
    moving = Ruckig(initial_velocity=(0.3, 0.1, 0.0, 0.0, 0.0, 0.0))
    still = problem_with()
    problem = replace(still, waypoints=[replace(still.waypoints[0], dwell=0.0), *still.waypoints[1:]], duration=5.0)
    result = plan(problem, moving).trajectory
    assert result.duration == pytest.approx(5.0, rel=1e-12)
    assert result.evaluate(0.0, [1])[0] == pytest.approx(moving.initial_velocity)


def test_where_nothing_moves_the_robot_rests_for_so_long() -> None:
    here = JointWaypoint(POSITIONS[0])
    assert plan(PlanningProblem(ROBOT, [here, here], duration=3.0)).trajectory.duration == 3.0
    held = replace(here, minimum_duration=2.0)
    assert plan(PlanningProblem(ROBOT, [here, held])).trajectory.duration == 2.0
    with pytest.raises(InfeasibleDuration, match=r"takes 2 s"):
        plan(PlanningProblem(ROBOT, [here, held], duration=3.0))


@pytest.mark.parametrize(
    ("problem", "field"),
    [
        (replace(problem_with(duration=3.0), duration=2.0), ("duration",)),
        (replace(problem_with(minimum_duration=3.0), duration=2.0), ("duration",)),
        (replace(problem_with(), duration=0.1), ("duration",)),
        (replace(problem_with(), duration=float("inf")), ("duration",)),
        (problem_with(duration=1.0, minimum_duration=2.0), ("waypoints", 2, "duration")),
        (problem_with(minimum_duration=-1.0), ("waypoints", 2, "minimum_duration")),
        (
            PlanningProblem(ROBOT, [JointWaypoint(POSITIONS[0], minimum_duration=1.0)]),
            ("waypoints", 0, "minimum_duration"),
        ),
        (
            PlanningProblem(
                ROBOT, [JointWaypoint(POSITIONS[0]), JointWaypoint(POSITIONS[1], duration=2.0)], duration=3.0
            ),
            ("duration",),
        ),
    ],
)
def test_durations_that_contradict_each_other_are_refused(problem: PlanningProblem, field: tuple[object, ...]) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        plan(problem)
    assert field in [fault.field for fault in refusal.value.faults]


def test_torque_limits_are_kept_by_a_slower_plan() -> None:
    """A torque limit just above the holding torque makes the motion long, and a longer motion still keeps it."""
    problem = problem_with()
    tight = replace(problem.limits, torque=tuple(0.12 * ROBOT.limit("torque")))
    try:
        fastest = plan(replace(problem, limits=tight), Toppra())
    except LimitsUnsatisfiable:
        pytest.fail("the limit holds the arm: the test is to be adapted")
    slower = plan(replace(problem, limits=tight, duration=3.0 * fastest.trajectory.duration), Toppra())
    assert worst(slower)["torque"] <= worst(fastest)["torque"]


def test_a_duration_of_the_whole_that_no_segment_can_take_is_refused() -> None:
    """The first segment is too short to move, and the second one has a duration."""
    start = (-0.7242775126083874, -1.6969734405392467, 0.8493749782236915, 0.15130299338, 0.07916018692694, 0.87508278)
    beside = (*np.add(start, 5e-10),)
    waypoints = [
        JointWaypoint(start),
        JointWaypoint(beside),
        JointWaypoint([-0.7, -1.7, 0.9, 0.1, 0.1, 0.9], duration=0.43895706428183856),
    ]
    with pytest.raises(InfeasibleDuration, match=r"it takes 0\.438957 s"):
        plan(PlanningProblem(load_robot("kuka_kr16_2"), waypoints, duration=11.893), Ruckig())
