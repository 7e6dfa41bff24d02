"""Goal sets against plans of every option by itself, and the reasons for the options that are not chosen."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pytest

import planner
from planner.fields import with_field
from planner.kinematics import tool_pose
from planner.planning import option_estimates, option_layers
from tests.sizes import NAME

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.problems.problem import AnyWaypoint

ARM = planner.load_robot("ur5e")
HOME = planner.JointWaypoint([0.0, -1.5, 1.5, -1.5, -1.5, 0.0], name="home")
LINE = planner.LinearMotion()
LIFT = planner.RelativeWaypoint(planner.CartesianMove((0.0, 0.0, 0.08)), "base", motion=LINE, name="lift")
FAR = planner.PoseWaypoint(planner.Pose([3.0, 0.0, 0.2]))
POST = planner.SceneObject("post", [planner.Box([0.08, 0.08, 0.8])], planner.Pose([-0.5, -0.25, 0.4]))

SEEDS = range(1 if NAME == "quick" else 12)

BACK_ENDS = ("trapezoidal", *(pytest.param(kind, marks=pytest.mark.large_only) for kind in ("cubic", "toppra")))

WORST = 0.05
"""The largest share by which the chosen option may be longer than the best one, on random problems."""


def pointing_down(x: float, y: float, z: float, turn: float = 0.0) -> planner.Pose:
    c, s = np.cos(turn), np.sin(turn)
    return planner.Pose([x, y, z], np.diag([1.0, -1.0, -1.0]) @ [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def grasp(x: float, y: float, z: float, turn: float = 0.0) -> planner.WaypointSequence:
    """Return an approach and a grasp."""
    above, there = pointing_down(x, y, z + 0.1, turn), pointing_down(x, y, z, turn)
    return planner.WaypointSequence([planner.PoseWaypoint(above), planner.PoseWaypoint(there, motion=LINE)])


def random_grasps(rng: np.random.Generator, count: int) -> list[planner.WaypointSequence]:
    """Return grasps on a table, some of them out of reach."""
    return [
        grasp(rng.uniform(0.3, 0.85), rng.uniform(-0.5, 0.5), rng.uniform(0.05, 0.3), rng.uniform(-1.0, 1.0))
        for _ in range(count)
    ]


def problem(*waypoints: AnyWaypoint | planner.AnyOf, **fields: object) -> planner.PlanningProblem:
    return planner.PlanningProblem(ARM, waypoints, **fields)


def turned(angle: float) -> planner.JointWaypoint:
    """Return a joint position with the arm stretched forwards; the post stands at an angle of 0.45 rad."""
    return planner.JointWaypoint([angle, -0.9, 1.2, -1.87, -1.57, 0.0])


def shortest(problems: Sequence[planner.PlanningProblem], kind: str) -> tuple[float, int | None]:
    """Plan every problem, and return the least duration and its index."""
    found: tuple[float, int | None] = (np.inf, None)
    for k, one in enumerate(problems):
        try:
            plan = planner.plan(one, kind, planner.Budget(attempts=1))
            found = min(found, (plan.trajectory.duration, k), key=lambda pair: pair[0])
        except planner.PlanningError:
            continue
    return found


def statuses(plan: planner.Plan | planner.PlanningError, goal_set: int = 0) -> list[str]:
    return [outcome.status for outcome in plan.choices[goal_set].options]


@pytest.mark.parametrize("kind", BACK_ENDS)
@pytest.mark.sized
@pytest.mark.parametrize("seed", SEEDS)
def test_the_chosen_option_is_the_shortest_of_all_plans(kind: str, seed: int) -> None:
    options = random_grasps(np.random.default_rng(seed), 4 if NAME == "quick" else 6)
    least, best = shortest([problem(HOME, *one.waypoints, LIFT, HOME) for one in options], kind)
    assert best is not None
    plan = planner.plan(problem(HOME, planner.AnyOf(options), LIFT, HOME), kind)
    option = plan.choices[0].option
    assert option is not None
    alone = planner.plan(problem(HOME, *options[option].waypoints, LIFT, HOME), kind)
    assert plan.trajectory.duration == alone.trajectory.duration <= (1.0 + WORST) * least
    assert plan.certificate.satisfied


@pytest.mark.sized
@pytest.mark.parametrize("seed", SEEDS)
def test_two_goal_sets_are_chosen_together(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = 2 if NAME == "quick" else 3
    picks, places = random_grasps(rng, count), random_grasps(rng, count)
    pairs = list(product(picks, places))
    singles = [problem(HOME, *one.waypoints, LIFT, *other.waypoints, HOME) for one, other in pairs]
    least, best = shortest(singles, "trapezoidal")
    assert best is not None
    plan = planner.plan(problem(HOME, planner.AnyOf(picks), LIFT, planner.AnyOf(places), HOME), "trapezoidal")
    assert plan.trajectory.duration <= (1.0 + WORST) * least
    one, other = (choice.option for choice in plan.choices)
    assert (
        plan.trajectory.duration
        == planner.plan(singles[pairs.index((picks[one], places[other]))], "trapezoidal").trajectory.duration
    )


@pytest.mark.sized
@pytest.mark.parametrize("seed", SEEDS)
def test_estimates_of_joint_positions_are_the_durations_of_trapezoids(seed: int) -> None:
    rng = np.random.default_rng(seed)
    options = [planner.JointWaypoint(rng.uniform(-2.0, 2.0, 6), dwell=rng.choice([0.0, 0.5])) for _ in range(4)]
    limits = planner.Limits(velocity_scale=0.5, acceleration_scale=0.1)
    plan = planner.plan(problem(HOME, planner.AnyOf(options), HOME, limits=limits), "trapezoidal")
    for option, outcome in zip(options, plan.choices[0].options, strict=True):
        alone = planner.plan(problem(HOME, option, HOME, limits=limits), "trapezoidal")
        assert outcome.estimated_duration == pytest.approx(alone.trajectory.duration, rel=1e-9)


def test_one_option_gives_the_plan_without_a_goal_set() -> None:
    option = grasp(0.5, 0.2, 0.1)
    plan = planner.plan(problem(HOME, planner.AnyOf([option]), HOME), "ruckig")
    alone = planner.plan(problem(HOME, *option.waypoints, HOME), "ruckig")
    assert (plan.trajectory.coefficients == alone.trajectory.coefficients).all()
    assert statuses(plan) == ["chosen"]
    assert alone.choices == ()


def test_the_first_of_equal_options_is_chosen() -> None:
    plan = planner.plan(problem(HOME, planner.AnyOf([grasp(0.5, 0.2, 0.1)] * 5), HOME))
    assert statuses(plan) == ["chosen", *["longer"] * 4]
    assert len({outcome.estimated_duration for outcome in plan.choices[0].options}) == 1


def test_a_hundred_options_have_one_chosen_and_a_reason_each() -> None:
    options = random_grasps(np.random.default_rng(5), 99)
    plan = planner.plan(problem(HOME, planner.AnyOf([FAR, *options]), LIFT, HOME), "trapezoidal")
    (choice,) = plan.choices
    assert statuses(plan).count("chosen") == 1
    assert choice.options[0].code == "unreachable_waypoint"
    chosen = choice.options[choice.option or 0].estimated_duration
    for outcome in choice.options:
        if outcome.status == "refused":
            assert outcome.code and outcome.message and outcome.estimated_duration is None
        else:
            assert outcome.estimated_duration >= chosen


def test_the_only_reachable_option_is_chosen() -> None:
    plan = planner.plan(problem(HOME, planner.AnyOf([FAR, FAR, grasp(0.5, 0.0, 0.1), FAR]), HOME))
    assert plan.choices[0].option == 2
    assert statuses(plan) == ["refused", "refused", "chosen", "refused"]


def test_options_in_a_collision_are_refused_with_that_reason() -> None:
    inside = planner.PoseWaypoint(pointing_down(-0.5, -0.25, 0.3))
    beside = planner.PoseWaypoint(pointing_down(-0.4, 0.4, 0.3), dwell=9.0)
    plan = planner.plan(problem(turned(0.0), planner.AnyOf([inside, beside]), scene=planner.Scene([POST])))
    assert [outcome.code for outcome in plan.choices[0].options] == ["collision", None]
    assert plan.choices[0].option == 1


@pytest.mark.large_only
def test_an_option_whose_motion_collides_gives_way_to_the_next() -> None:
    """The way to the nearer option leads straight through the post; both ends are free."""
    start, behind, away = turned(0.0), turned(0.9), turned(-1.5)
    scene = planner.Scene([POST])
    with pytest.raises(planner.Collision):
        planner.plan(problem(start, behind, scene=scene))
    plan = planner.plan(problem(start, planner.AnyOf([behind, away]), scene=scene))
    assert plan.choices[0].option == 1
    assert plan.choices[0].options[0].code == "collision"
    assert "on the way from waypoint 0 to 1" in (plan.choices[0].options[0].message or "")


def test_refusals_name_the_option_and_have_proved_remedies() -> None:
    far = replace(FAR, pose=planner.Pose([1.5, 0.0, 0.2]))
    request = problem(HOME, planner.AnyOf([far, grasp(2.0, 0.0, 0.1)]), HOME)
    with pytest.raises(planner.UnreachableWaypoint) as caught:
        planner.plan(request)
    refusal = caught.value
    assert refusal.waypoint == 1
    assert "no option has a plan; with option 0 of waypoint 1" in str(refusal)
    assert refusal.choices[0].option is None
    assert [outcome.code for outcome in refusal.choices[0].options] == ["unreachable_waypoint"] * 2
    (remedy,) = refusal.remedies
    assert remedy.field == ("waypoints", 1, "options", 0, "pose")
    assert planner.plan(remedy.applied_to(request)).choices[0].option == 0


def test_a_refusal_elsewhere_in_the_list_keeps_its_place() -> None:
    request = problem(HOME, planner.AnyOf([grasp(0.5, 0.2, 0.1), grasp(0.4, 0.1, 0.1)]), FAR)
    with pytest.raises(planner.UnreachableWaypoint) as caught:
        planner.plan(request)
    assert caught.value.waypoint == 2
    assert statuses(caught.value) == ["untried", "untried"]


def test_a_start_in_a_collision_tries_no_other_option() -> None:
    scene = planner.Scene([POST])
    with pytest.raises(planner.StartInCollision) as caught:
        planner.plan(problem(turned(0.45), planner.AnyOf([turned(0.0), turned(0.9)]), scene=scene))
    assert statuses(caught.value) == ["untried", "untried"]


def test_a_relative_waypoint_behind_a_goal_set_rules_out_options() -> None:
    """From the higher grasp the lift leads out of the workspace."""
    high = planner.RelativeWaypoint(planner.CartesianMove((0.0, 0.0, 0.45)), "base", motion=LINE)
    options = [planner.PoseWaypoint(pointing_down(0.5, 0.1, 0.6)), planner.PoseWaypoint(pointing_down(0.5, -0.3, 0.1))]
    plan = planner.plan(problem(HOME, planner.AnyOf(options), high, HOME))
    assert statuses(plan) == ["refused", "chosen"]


def test_the_plan_reaches_the_chosen_option_and_counts_as_the_request() -> None:
    option = grasp(0.5, 0.2, 0.1)
    actions = [
        planner.SetOutput(planner.AtWaypoint(1), "gripper", True),
        planner.SetOutput(planner.AtWaypoint(3), "done", True),
    ]
    plan = planner.plan(problem(HOME, planner.AnyOf([option], name="pick", dwell=0.3), LIFT, HOME, actions=actions))
    assert plan.requested_indices == (0, 1, 1, 2, 3)
    (choice,) = plan.choices
    assert (choice.waypoint, choice.first, choice.last) == (1, 1, 2)
    reached = tool_pose(ARM, plan.path.positions[2])
    np.testing.assert_allclose(reached.position, [0.5, 0.2, 0.1], atol=1e-6)
    assert plan.trajectory.departures[2] - plan.trajectory.arrivals[2] == pytest.approx(0.3)
    assert [action.time for action in plan.actions] == pytest.approx(
        [plan.trajectory.arrivals[2], plan.trajectory.arrivals[4]]
    )


def test_a_region_is_an_option_where_only_a_part_of_it_can_be_reached() -> None:
    far = planner.PoseWaypoint(pointing_down(1.1, 0.0, 0.3), free=planner.Region(x=(-0.6, 0.0)))
    plan = planner.plan(problem(HOME, planner.AnyOf([FAR, far]), HOME))
    assert plan.choices[0].option == 1


def test_a_region_out_of_reach_leaves_the_goal_set_to_other_options() -> None:
    away = planner.PoseWaypoint(pointing_down(3.0, 0.0, 0.2), free="rotation_z")
    plan = planner.plan(problem(HOME, planner.AnyOf([away, grasp(0.4, 0.2, 0.2)])), planner.Trapezoidal())
    assert [outcome.code for outcome in plan.choices[0].options] == ["unreachable_waypoint", None]
    with pytest.raises(planner.UnreachableWaypoint):
        planner.plan(problem(HOME, planner.AnyOf([away, away])), planner.Trapezoidal())


def test_a_redundant_arm_chooses_among_poses_and_named_positions() -> None:
    arm = planner.load_robot("fr3")
    name = next(iter(arm.named_positions))
    here = planner.JointWaypoint.named(arm, name)
    near = tool_pose(arm, np.array(here.position) + 0.05)
    options = [planner.PoseWaypoint(planner.Pose([0.4, 0.4, 0.4])), here, planner.PoseWaypoint(near), FAR]
    plan = planner.plan(planner.PlanningProblem(arm, [here, planner.AnyOf(options)]))
    assert plan.choices[0].option == 1
    assert statuses(plan) == ["longer", "chosen", "longer", "refused"]


def turned_regions(count: int, x: float) -> planner.AnyOf:
    """Return poses on a circle about a point, which the tool may reach with any turn."""
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    poses = [pointing_down(x + 0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.2) for angle in angles]
    return planner.AnyOf([planner.PoseWaypoint(pose, free="rotation_z") for pose in poses])


BUDGETS = ({"optimise": "duration", "time_budget": 1e-9}, planner.Budget()), ({}, planner.Budget(seconds=1e-9))


@pytest.mark.parametrize(("fields", "budget"), BUDGETS, ids=["time budget", "deadline"])
def test_the_time_ends_the_comparison_of_many_regions(fields: dict[str, object], budget: planner.Budget) -> None:
    """Three goal sets of 300 regions took 20 s where one option takes 0.2 s."""
    request = problem(HOME, *[turned_regions(100, x) for x in (0.5, 0.4, 0.6)], **fields)
    plan = planner.plan(request, "trapezoidal", budget)
    assert plan.certificate.satisfied
    assert [choice.option for choice in plan.choices] == [0, 0, 0]
    durations = [outcome.estimated_duration or np.inf for outcome in plan.choices[0].options]
    for outcome, duration in zip(plan.choices[0].options[1:], durations[1:], strict=True):
        assert outcome.status == ("longer" if durations[0] <= duration < np.inf else "untried")
    assert "untried" in statuses(plan)


def test_the_time_ends_the_search_in_regions_out_of_reach() -> None:
    """Each of them takes 10 ms of search; the first option of each goal set has it, the others are not tried."""
    request = problem(HOME, *[turned_regions(60, 3.0)] * 3)
    with pytest.raises(planner.UnreachableWaypoint) as caught:
        planner.plan(request, "trapezoidal", planner.Budget(seconds=1e-9))
    assert "no option compared in time has a plan; with option 0 of waypoint 1" in str(caught.value)
    for k in range(3):
        assert statuses(caught.value, k) == ["refused", *["untried"] * 59]


def test_options_compared_one_by_one_have_the_same_estimates(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    picks, places = random_grasps(rng, 20), [*random_grasps(rng, 9), planner.WaypointSequence([turned(0.3)])]
    region = planner.PoseWaypoint(pointing_down(1.1, 0.0, 0.3), free=planner.Region(x=(-0.6, 0.0)))
    request = problem(HOME, planner.AnyOf([FAR, region, *picks]), LIFT, planner.AnyOf(places), HOME)
    together = planner.plan(request, "trapezoidal").choices
    monkeypatch.setattr(option_layers, "SOLVED_TOGETHER", 1)
    monkeypatch.setattr(option_estimates, "TIMED_TOGETHER", 1)
    assert planner.plan(request, "trapezoidal").choices == together


WRONG = {
    "tool": (replace(HOME, tool=planner.Pose([0.0, 0.0, 0.1])), ("tool",), "must be None in an option"),
    "relative": (LIFT, (), "must not begin with a relative waypoint"),
    "nested": (planner.AnyOf([HOME]), (), "must be a waypoint of another kind"),
    "empty": (planner.WaypointSequence([]), ("waypoints",), "must have at least one waypoint"),
    "joints": (planner.JointWaypoint([0.0] * 5), ("position",), "5 values for the 6 joints"),
    "in a sequence": (
        planner.WaypointSequence([HOME, planner.JointWaypoint([np.nan] * 6)]),
        ("waypoints", 1, "position"),
        "finite",
    ),
    "duration": (replace(HOME, minimum_duration=-1.0), ("minimum_duration",), "must"),
}


@pytest.mark.parametrize("name", WRONG)
def test_faults_point_to_the_option(name: str) -> None:
    option, field, message = WRONG[name]
    with pytest.raises(planner.InvalidProblem) as caught:
        planner.plan(problem(HOME, planner.AnyOf([HOME, HOME, option])))
    (fault,) = caught.value.faults
    assert fault.field == ("waypoints", 1, "options", 2, *field)
    assert message in fault.message


def test_a_goal_set_has_neither_a_motion_nor_no_options() -> None:
    with pytest.raises(planner.InvalidProblem) as caught:
        planner.plan(problem(HOME, planner.AnyOf([], motion=LINE)))
    assert [fault.field for fault in caught.value.faults] == [("waypoints", 1, "motion"), ("waypoints", 1, "options")]


def test_a_pair_of_options_that_collides_leaves_both_to_other_pairs() -> None:
    """The straight motion between the sides of the post collides; the motions on one side are free."""
    scene = planner.Scene([POST])
    plan = planner.plan(
        problem(
            turned(0.0),
            planner.AnyOf([turned(-0.1), turned(-0.2)]),
            planner.AnyOf([turned(0.9), turned(-1.5)]),
            scene=scene,
        )
    )
    assert [choice.option for choice in plan.choices] == [0, 1]
    singles = [
        problem(turned(0.0), one, other, scene=scene)
        for one, other in product((turned(-0.1), turned(-0.2)), (turned(0.9), turned(-1.5)))
    ]
    assert shortest(singles, "cubic")[0] == plan.trajectory.duration


def _turned_by(angle: float) -> list[float]:
    """Return home with the first joint turned."""
    return [HOME.position[0] + angle, *HOME.position[1:]]


def test_warnings_and_certificates_point_into_the_request() -> None:
    away, back = _turned_by(0.5), HOME.position
    slow = planner.JointWaypoint(back, limits=planner.Limits(velocity_scale=0.1))
    goal = planner.AnyOf([planner.WaypointSequence([planner.JointWaypoint(away), slow])])
    plan = planner.plan(problem(HOME, goal, planner.JointWaypoint(back)), "trapezoidal")
    (repeated,) = (warning for warning in plan.warnings if warning.code == "waypoint_repeated")
    assert repeated.message.startswith("waypoint 2: ")
    (velocity,) = (check for check in plan.certificate.checks if check.quantity == "velocity")
    assert (velocity.segment, velocity.relaxed_by) == (
        0,
        ("robot.velocity", "waypoints[1].options[0].waypoints[1].limits.velocity_scale"),
    )


def test_an_option_with_too_heavy_a_payload_is_refused_alone() -> None:
    near, far = (planner.JointWaypoint(_turned_by(by)) for by in (0.2, 0.5))
    heavy = planner.WaypointSequence([near, replace(near, payload=planner.Payload(100.0))])
    plan = planner.plan(problem(HOME, planner.AnyOf([heavy, far]), HOME))
    assert [outcome.code for outcome in plan.choices[0].options] == ["payload_exceeded", None]


def test_the_remedy_of_a_heavy_payload_works_in_the_request() -> None:
    heavy = planner.JointWaypoint(_turned_by(0.2), payload=planner.Payload(100.0))
    goal = planner.AnyOf([planner.WaypointSequence([HOME, HOME, heavy])])
    refused = problem(HOME, goal, HOME)
    with pytest.raises(planner.PayloadExceeded) as refusal:
        planner.plan(refused)
    assert refusal.value.waypoint == 1
    (remedy,) = refusal.value.remedies
    assert remedy.field == ("waypoints", 1, "options", 0, "waypoints", 2, "payload", "mass")
    planner.plan(with_field(refused, remedy.field, remedy.value))


def test_a_heavy_payload_beside_a_goal_set_is_refused_at_its_waypoint() -> None:
    goal = planner.AnyOf([planner.WaypointSequence([HOME, HOME])] * 3)
    heavy = replace(HOME, payload=planner.Payload(100.0))
    with pytest.raises(planner.PayloadExceeded) as refusal:
        planner.plan(problem(HOME, goal, heavy, HOME))
    assert refusal.value.waypoint == 2


@pytest.mark.parametrize("dwell", [-1.0, np.nan, np.inf])
def test_dwells_must_be_finite_and_not_negative(dwell: float) -> None:
    waypoint = replace(HOME, dwell=dwell)
    goal = planner.AnyOf([replace(HOME, dwell=3.0)], dwell=dwell)
    for one in (waypoint, goal):
        with pytest.raises(planner.InvalidProblem) as refusal:
            planner.plan(problem(HOME, one, HOME))
        (fault,) = refusal.value.faults
        assert fault.field == ("waypoints", 1, "dwell")


def test_an_action_at_no_waypoint_is_one_fault() -> None:
    goal = planner.AnyOf([HOME, planner.WaypointSequence([HOME, HOME])])
    late = planner.SetOutput(planner.AtWaypoint(3), "gripper", True)
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.plan(problem(HOME, goal, HOME, actions=(late,)))
    (fault,) = refusal.value.faults
    assert fault.field == ("actions", 0, "at", "waypoint")
