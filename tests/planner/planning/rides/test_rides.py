"""Rides on moving objects: the tool stays with the part at dense samples, and no sooner ride has a plan."""

from __future__ import annotations

from dataclasses import replace
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
from tests.planner.planning.rides.belt import (
    ABOVE,
    ARM,
    DOWN,
    GRIP,
    HOME,
    LINE,
    ONCE,
    PLACE,
    later,
    off_part,
    on,
    part,
    pick,
    problem,
    seen_from_part,
)

BELTS: dict[str, tuple[planner.SceneObject, float]] = {
    "along y": (part(), 2.5),
    "along x": (part((-0.9, -0.4, 0.15), (0.15, 0.0, 0.0)), 2.0),
    "diagonal and up": (part((-0.7, -0.7, 0.1), (0.1, 0.15, 0.03)), 2.0),
    "slow": (part((-0.5, -0.2, 0.15), (0.0, 0.01, 0.0)), 2.0),
    "fast": (part((-0.5, -1.4, 0.15), (0.0, 0.5, 0.0)), 2.4),
    "turned, and stops": (part(end=5.0, turn=0.4), 2.5),
}

MORE = {"along x", "slow", "fast"}
"""The belts of the large size."""

LARGE = (pytest.mark.large_only,)


def checks_on_part(plan: planner.Plan) -> list[planner.Check]:
    """Return the checks of the tool on its object."""
    return [check for check in plan.certificate.checks if check.quantity.startswith("object_")]


@pytest.mark.parametrize("name", [pytest.param(name, marks=LARGE if name in MORE else ()) for name in BELTS])
def test_the_tool_stays_with_the_part_at_dense_samples(name: str) -> None:
    thing, earliest = BELTS[name]
    plan = planner.plan(problem(thing, pick(earliest)), "ruckig", ONCE)
    (ride,) = plan.rides
    assert ride.arrival == pytest.approx(earliest)
    position, orientation = checks_on_part(plan)
    far, turned = off_part(plan, thing)
    assert 0.0 < far <= position.peak <= position.limit == 1e-4
    assert turned <= orientation.peak <= orientation.limit == 1e-3
    assert position.lower is not None
    assert position.lower <= far * 1.05 + 1e-9
    # Before and after, it rests in the world: there it is not on the part.
    before, after = seen_from_part(plan, thing, np.array([ride.begin, ride.end]))
    assert np.linalg.norm(before.translation - ABOVE.position) > 10.0 * far
    assert np.linalg.norm(after.translation - ABOVE.position) > 10.0 * far
    times = np.linspace(0.0, plan.trajectory.duration, 2000)
    for k, limit in enumerate(("velocity", "acceleration", "jerk"), 1):
        assert (np.abs(plan.trajectory.evaluate(times, [k])[0]) <= ARM.limit(limit) * (1.0 + 1e-9)).all()


@pytest.mark.parametrize(
    "backend",
    [
        "cubic",
        "trapezoidal",
        *(pytest.param(kind, marks=LARGE) for kind in ("quintic", "toppra", "min_effort", "auto")),
    ],
)
def test_every_back_end_rides(backend: str) -> None:
    thing = part()
    plan = planner.plan(problem(thing, [on(ABOVE, dwell=0.2, earliest_arrival=2.5)]), backend, ONCE)
    assert off_part(plan, thing)[0] <= 1e-4
    assert plan.trajectory.departures[2] - plan.trajectory.arrivals[2] == pytest.approx(0.2)


def test_arms_of_seven_joints_and_mounted_ones_ride() -> None:
    thing = part((0.45, -0.6, 0.2), (0.0, 0.1, 0.0))
    home, place = [0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.8], [0.6, -0.6, 0.0, -2.2, 0.0, 1.6, 0.8]
    mounting = Pose.from_rpy([0.02, 0.1, -0.05], [0.0, 0.0, 0.7])
    robot = planner.load_robot("fr3").derived(mounting=mounting)
    given = problem(
        thing, [on(ABOVE, earliest_arrival=4.0), on(GRIP, motion=LINE)], robot=robot, home=home, place=place
    )
    plan = planner.plan(given, "ruckig", ONCE)
    assert off_part(plan, thing)[0] <= checks_on_part(plan)[0].peak <= 1e-4
    assert plan.certificate.continuity == "C2"


def test_the_check_sees_wrong_times_and_wrong_speeds() -> None:
    thing = part()
    plan = planner.plan(problem(thing, pick(2.5)), "ruckig", ONCE)
    late = with_wait(plan.trajectory, 0, 2e-3)  # 0.4 mm on the belt
    (position, _) = certify_rides(late, plan.problem)
    assert position.peak == pytest.approx(4e-4, rel=0.02)
    assert not position.satisfied
    faster = replace(thing, motion=planner.ConstantVelocity([0.0, 0.202, 0.0]))
    other = tuple(
        replace(w, motion=replace(w.motion, thing=faster)) if isinstance(w.motion, RideMotion) else w
        for w in plan.problem.waypoints
    )
    (position, _) = certify_rides(plan.trajectory, replace(plan.problem, waypoints=other))
    assert not position.satisfied
    stopped = replace(thing, motion=planner.ConstantVelocity([0.0, 0.2, 0.0], end=2.6))
    other = tuple(
        replace(w, motion=replace(w.motion, thing=stopped)) if isinstance(w.motion, RideMotion) else w
        for w in plan.problem.waypoints
    )
    (position, _) = certify_rides(plan.trajectory, replace(plan.problem, waypoints=other))
    assert not position.satisfied, "the part stops before it is taken"


def test_no_time_of_a_scan_has_a_sooner_ride() -> None:
    thing = part()
    given = problem(thing, pick())
    plan = planner.plan(given, "ruckig")
    (ride,) = plan.rides
    boardings = Boardings(given, rides_of(given)[0])
    for time in np.linspace(0.0, ride.arrival - 2.0 * ARRIVAL_KNOWN_TO, 4).tolist():
        boarding = boardings.at(time)
        if isinstance(boarding, Boarding):
            outcome = Attempt(with_boarding(boardings, boarding), plan.backend).made()
            assert not isinstance(outcome, Planned), f"a ride at {time} s is sooner"


@pytest.mark.large_only
def test_a_program_may_begin_at_its_latest_start_and_no_later() -> None:
    thing, some = part(), planner.Budget(attempts=12)
    given = problem(thing, pick())
    plan = planner.plan(given, "ruckig")
    (ride,) = plan.rides
    start = ride.latest_start
    assert start > 4.0

    def begun_at(time: float) -> planner.Plan:
        first = planner.JointWaypoint(HOME, dwell=time)
        return planner.plan(replace(given, waypoints=(first, *given.waypoints[1:])), "ruckig", some)

    delayed = begun_at(start)
    (then,) = delayed.rides
    assert off_part(delayed, thing)[0] <= 1e-4
    assert then.arrival > ride.arrival + 4.0
    with pytest.raises(planner.PlanningError):
        begun_at(start + 0.2)
    # A part that is so much further has a plan, too: the latest start is a time on its clock.
    further = planner.plan(problem(later(thing, start), pick()), "ruckig", some)
    assert further.rides


def test_the_part_moves_with_the_tool_once_it_is_taken() -> None:
    """A wall beside the belt is in the way of the part that is carried, and not of the empty tool."""
    thing = part()
    reaching = Pose([-0.5, -0.2, 0.15 + 0.115])  # where the part is when it has been lifted, about
    wall = planner.SceneObject("wall", [planner.Box([0.01, 2.0, 0.02])], Pose([-0.5, 0.6, 0.29]))
    assert wall.pose.position[2] > reaching.position[2]
    lifted = [*pick(2.5)[:2], on(Pose([0.0, 0.0, 0.2], DOWN), motion=LINE)]
    free = planner.plan(problem(thing, lifted), "ruckig", ONCE)
    clearance = free.certificate.clearance
    assert clearance is not None
    assert clearance.contacts is not None
    assert clearance.contacts.pair == ("link_6", "part")
    ends = [waypoint.motion for waypoint in free.problem.waypoints if isinstance(waypoint.motion, RideMotion)]
    assert len(ends) == 4
    assert free.problem.scene is not None
    (moving,) = free.problem.scene.objects
    assert moving.motion is not None
    assert moving.motion.stop == pytest.approx(free.trajectory.arrivals[3])


def test_a_ride_is_as_slow_as_the_given_duration_and_windows_hold() -> None:
    thing = part()
    near = Pose([0.0, 0.0, 0.1], DOWN)
    waypoints = [
        on(ABOVE, earliest_arrival=2.5),
        on(near, motion=LINE, duration=1.0),
        on(ABOVE, motion=LINE, dwell=0.1),
    ]
    actions = [planner.SetOutput(planner.AtWaypoint(2), "grip", True)]
    given = problem(thing, waypoints, actions=actions)
    waypoints_after = replace(given.waypoints[-1], earliest_arrival=9.0)
    plan = planner.plan(replace(given, waypoints=(*given.waypoints[:-1], waypoints_after)), "ruckig", ONCE)
    arrivals, departures = plan.trajectory.arrivals, plan.trajectory.departures
    assert plan.requested_indices == (0, 1, 1, 2, 3, 4, 4)
    assert arrivals[3] - departures[2] == pytest.approx(1.0)
    assert arrivals[-1] == pytest.approx(9.0)
    assert off_part(plan, thing)[0] <= 1e-4
    assert [action.time for action in plan.actions] == pytest.approx([arrivals[3]])


def test_free_motions_lead_to_a_ride_and_away() -> None:
    thing = part()
    wall = planner.SceneObject("wall", [planner.Box([0.3, 0.02, 0.5])], Pose([-0.5, 0.05, 0.25]))
    waypoints = [on(ABOVE, motion=planner.FreeMotion(), earliest_arrival=3.0)]
    given = problem(thing, waypoints, wall, place=planner.JointWaypoint(PLACE, motion=planner.FreeMotion()))
    plan = planner.plan(given, "ruckig", ONCE)
    assert off_part(plan, thing)[0] <= 1e-4
    (ride,) = plan.rides
    assert ride.arrival == pytest.approx(3.0)


def test_a_ride_of_one_touch_is_checked_saved_and_loaded(tmp_path: Any) -> None:
    thing = part()
    plan = planner.plan(problem(thing, [on(ABOVE, earliest_arrival=2.5)]), "ruckig", ONCE)
    plan.save(tmp_path / "ride.plan")
    loaded = planner.load(tmp_path / "ride.plan")
    assert loaded.rides == plan.rides
    assert (loaded.trajectory.coefficients == plan.trajectory.coefficients).all()
    assert "object_position_deviation" in planner.write_proof(plan)["statement"]["not_covered"]
    late = with_wait(plan.trajectory, 0, 2e-3)  # 0.4 mm on the belt
    (position, _) = certify_rides(late, plan.problem)
    assert position.peak == pytest.approx(4e-4, rel=0.02)


def refused(*args: Any, **more: Any) -> planner.PlanningError:
    """Return the refusal of a problem."""
    with pytest.raises(planner.PlanningError) as refusal:
        planner.plan(problem(*args, **more), "ruckig", planner.Budget(attempts=12))
    return refusal.value


def test_a_part_out_of_reach_is_refused() -> None:
    far = refused(part((3.0, -0.9, 0.15)), pick())
    assert far.code == "unreachable_waypoint"
    assert "out of reach of ur5e" in far.message
    gone = refused(part((-0.5, 1.5, 0.15)), pick())
    assert gone.code == "unreachable_waypoint"


@pytest.mark.large_only
def test_a_part_that_is_too_fast_for_a_joint_is_refused_with_the_joint() -> None:
    fast = refused(part((-0.4, -3.0, 0.15), (0.0, 3.0, 0.0)), [on(GRIP)])
    assert fast.code == "limits_unsatisfiable"
    assert "'part' is too fast" in fast.message
    assert fast.waypoint == 1


@pytest.mark.large_only
def test_a_deadline_that_has_passed_is_refused_with_the_arrival_that_works() -> None:
    soon = refused(part(), [on(ABOVE, latest_arrival=1.0)])
    assert soon.code == "infeasible_duration"
    assert soon.limit is not None
    assert 1.0 < soon.limit < 1.6
    assert "the earliest arrival found" in soon.message
    (remedy,) = soon.remedies
    assert remedy.field == ("waypoints", 1, "latest_arrival")
    later_one = [on(ABOVE, latest_arrival=remedy.value)]
    assert planner.plan(problem(part(), later_one), "ruckig").rides


def test_a_start_in_collision_and_a_spent_budget_are_told() -> None:
    seen: list[planner.Progress] = []
    around = planner.SceneObject("post", [planner.Box([0.1] * 3)], planner.tool_pose(ARM, np.array(HOME)))
    with pytest.raises(planner.StartInCollision):
        planner.plan(
            problem(part(), [on(ABOVE, earliest_arrival=3.0)], around), budget=planner.Budget(on_progress=seen.append)
        )
    assert len(seen) == 1, "no other time of arrival helps"
    with pytest.raises(planner.InfeasibleDuration, match="before the budget of attempts ended"):
        planner.plan(problem(part(), [on(ABOVE)]), "ruckig", ONCE)


@pytest.mark.large_only
def test_a_plan_whose_search_was_ended_says_so() -> None:
    whole, ended = (planner.plan(problem(part(), pick()), "ruckig", planner.Budget(attempts=k)) for k in (100, 3))
    (best,), (first,) = whole.rides, ended.rides
    said = ["ride_search_ended" in [warning.code for warning in plan.warnings] for plan in (whole, ended)]
    assert said == [False, True]
    assert first.arrival >= best.arrival
    assert first.latest_start <= best.latest_start


def test_configurations_hold_all_along_a_ride() -> None:
    thing = part()
    down, up = planner.Configuration(elbow="down"), planner.Configuration(elbow="up")
    plan = planner.plan(problem(thing, [on(ABOVE, configuration=down, earliest_arrival=2.5)]), "ruckig", ONCE)
    (reached,) = planner.configurations(ARM, plan.trajectory.at_arrivals[[2]])
    assert reached.elbow == "down"
    given = problem(thing, [on(ABOVE, configuration=down), on(GRIP, motion=LINE, configuration=up)])
    refusal = Boardings(given, rides_of(given)[0]).at(2.5)
    assert isinstance(refusal, planner.ConfigurationChange)
    assert refusal.waypoint == 2


POSE = planner.PoseWaypoint(Pose([-0.5, -0.2, 0.4], DOWN))


@pytest.mark.parametrize(
    ("waypoints", "field", "words"),
    [
        ([planner.PoseWaypoint(ABOVE, on="nothing")], ("waypoints", 1, "on"), "must name an object of the scene"),
        ([planner.PoseWaypoint(ABOVE, on="table")], ("waypoints", 1, "on"), "stands still"),
        ([planner.PoseWaypoint(ABOVE, on="door")], ("waypoints", 1, "on"), "constant velocity"),
        ([on(ABOVE, attach=[planner.Attach("part")]), POSE, on(ABOVE)], ("waypoints", 3, "on"), "has taken"),
        (
            [on(ABOVE), replace(POSE, attach=[planner.Attach("part")])],
            ("waypoints", 2, "attach", 0, "id"),
            "without end",
        ),
        ([on(Pose([0.0, 0.0, 0.1]))], ("waypoints", 1, "pose"), "orientation"),
        ([on(ABOVE, free="rotation_z")], ("waypoints", 1, "free"), "on an object"),
        ([on(ABOVE, frame=Pose([0.0, 0.0, 0.1]))], ("waypoints", 1, "frame"), "on an object"),
        ([on(ABOVE), on(GRIP)], ("waypoints", 2, "motion"), "straight line"),
        ([on(ABOVE, motion=LINE)], ("waypoints", 1, "motion"), "joint or free motion"),
        ([on(ABOVE), replace(POSE, motion=LINE)], ("waypoints", 2, "motion"), "away from an object"),
        ([on(ABOVE, duration=1.0)], ("waypoints", 1, "duration"), "the object determines"),
        ([on(ABOVE), on(GRIP, motion=LINE, earliest_arrival=3.0)], ("waypoints", 2, "earliest_arrival"), "after the"),
        ([on(ABOVE, attach=[planner.Attach("table")])], ("waypoints", 1, "attach", 0, "id"), "must be 'part'"),
        ([on(ABOVE, transition=planner.ThroughTransition())], ("waypoints", 1, "transition"), "must be a stop"),
    ],
)
def test_waypoints_on_objects_that_mean_nothing_are_refused(waypoints: Any, field: Any, words: str) -> None:
    table = planner.SceneObject("table", [planner.Box([0.1] * 3)], Pose([2.0, 0.0, 0.0]))
    door = planner.SceneObject(
        "door",
        [planner.Box([0.1] * 3)],
        Pose([2.0, 1.0, 0.0]),
        motion=planner.TimedPoses([1.0], [Pose([2.0, 2.0, 0.0])]),
    )
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.plan(problem(part(), waypoints, table, door), "ruckig")
    faults = {fault.field: fault.message for fault in refusal.value.faults}
    assert words in faults[field], faults


def test_fields_of_the_problem_that_rides_leave_out_are_refused() -> None:
    given = problem(part(), [on(ABOVE)], duration=9.0)
    with pytest.raises(planner.InvalidProblem, match="duration: must be left out with waypoints on a moving object"):
        planner.plan(given)
    given = problem(part(), [on(ABOVE)], optimise="duration")
    with pytest.raises(planner.InvalidProblem, match="optimise: must be left out"):
        planner.plan(given)
    given = problem(part(), [on(ABOVE), planner.AnyOf([POSE])])
    with pytest.raises(planner.InvalidProblem, match="goal set"):
        planner.plan(given)
    given = problem(part(), [planner.AnyOf([POSE, on(ABOVE)])])
    with pytest.raises(planner.InvalidProblem, match="must be left out in an option"):
        planner.plan(given)
    with pytest.raises(planner.InvalidProblem, match="must be left out at the last waypoint"):
        planner.plan(planner.PlanningProblem(ARM, [HOME, on(ABOVE)], scene=planner.Scene([part()])))
    with pytest.raises(planner.InvalidProblem, match="the robot starts at rest"):
        planner.plan(planner.PlanningProblem(ARM, [on(ABOVE), HOME], scene=planner.Scene([part()])))
    with pytest.raises(planner.InvalidProblem, match="must name an object of the scene"):
        planner.plan(planner.PlanningProblem(ARM, [HOME, on(ABOVE), HOME]))


def test_programs_of_robots_cannot_ride() -> None:
    plan = planner.plan(problem(part(), [on(ABOVE, earliest_arrival=2.5)]), "ruckig", ONCE)
    with pytest.raises(planner.errors.UnsupportedFormat, match="does not know where 'part' is"):
        planner.render(plan, "urscript_moves", planner.ExportOptions())
