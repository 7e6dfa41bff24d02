"""Plans whose duration is optimised, compared with plans without it and with brute force."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from time import monotonic

import numpy as np
import pytest

import planner
from benchmarks.trajectories.off_path import REGION, WITHIN, durations_by_search, through_poses
from planner.errors import InvalidProblem
from planner.problems.regions import Region
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from tests.sizes import SIZE

UR5E, PANDA = planner.load_robot("ur5e"), "panda"
"""An arm, and a redundant one with constant limits, of the extra `robots`: without that its tests are skipped."""

MOST_EVALUATIONS = 80 if SIZE.one_in > 1 else 200
"""The evaluations of each search by brute force."""


def optimised(problem: planner.PlanningProblem, backend: str, iterates: int = 10) -> planner.Plan:
    """Plan with an optimised duration."""
    return planner.plan(replace(problem, optimise="duration", optimise_iterates=iterates), backend)


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("backend", "transition"),
    [
        ("trapezoidal", StopTransition()),
        ("cubic", ThroughTransition()),
        ("toppra", BlendTransition(0.05)),
        ("ruckig", BlendTransition(0.05)),
    ],
    ids=["stop", "through", "blend", "jerk-limited"],
)
def test_no_plan_is_longer_than_without_the_optimisation(backend: str, transition: Transition) -> None:
    """The plan is certified, meets each pose within its region, and reports both durations."""
    problem = through_poses(UR5E, 0, 2, transition, REGION)
    first, plan = planner.plan(problem, backend), optimised(problem, backend, 6)
    report = plan.optimisation
    assert first.optimisation is None
    assert report is not None
    assert report.first == first.trajectory.duration
    assert report.last == plan.trajectory.duration <= first.trajectory.duration
    assert plan.certificate.satisfied
    if isinstance(transition, BlendTransition):
        return
    for k, waypoint in enumerate(problem.waypoints):
        if isinstance(waypoint, planner.PoseWaypoint):
            reached = planner.forward_kinematics(UR5E, plan.trajectory.at_arrivals[k])
            offsets = REGION.offsets(waypoint.pose, reached)
            again = REGION.pose(waypoint.pose, np.array([*offsets.values()]))
            assert reached.position == pytest.approx(again.position, abs=3e-6)
            assert all(low - 1e-5 <= offsets[name] <= high + 1e-5 for name, (low, high) in REGION.ranges.items())


def test_the_elbow_of_a_redundant_arm_shortens_the_duration() -> None:
    """Here it saves more than 5 %, and equal requests have equal plans."""
    problem = through_poses(planner.load_robot(PANDA), 0, 3)
    plan = optimised(problem, "ruckig")
    report = plan.optimisation
    assert report is not None
    assert report.last < 0.95 * report.first
    assert set(report.moved) <= {1, 2, 3}
    again = optimised(problem, "ruckig")
    assert (again.trajectory.coefficients == plan.trajectory.coefficients).all()


@pytest.mark.sized
@pytest.mark.parametrize("seed", range(max(1, 8 // SIZE.one_in)))
@pytest.mark.parametrize(("name", "free"), [(PANDA, None), ("ur5e", REGION)], ids=["elbow", "region"])
def test_the_duration_is_within_5_percent_of_brute_force(name: str, free: Region | None, seed: int) -> None:
    """Several Nelder-Mead searches with the closed form of the duration find nothing much better."""
    problem = through_poses(planner.load_robot(name), seed, 2, free=free)
    searches = durations_by_search(problem, free, MOST_EVALUATIONS, 1)
    best = min(islice(searches, 2 if SIZE.one_in > 1 else 6))
    assert optimised(problem, "trapezoidal", 30).trajectory.duration <= WITHIN * best


def test_a_fully_determined_request_has_the_same_plan_and_a_warning() -> None:
    """Joint waypoints with stops leave nothing open."""
    problem = planner.PlanningProblem(UR5E, [UR5E.middle, UR5E.middle + 0.3])
    plan, without = optimised(problem, "cubic"), planner.plan(problem, "cubic")
    assert (plan.trajectory.coefficients == without.trajectory.coefficients).all()
    assert {warning.code for warning in plan.warnings} - {warning.code for warning in without.warnings} == {
        "nothing_to_optimise"
    }
    assert plan.optimisation is not None
    assert plan.optimisation.iterates == 0


def test_blends_and_passed_waypoints_keep_their_neighbours() -> None:
    """With joint waypoints and a blend only the radius is open, which never grows."""
    waypoints = [
        planner.JointWaypoint(UR5E.middle - 0.2),
        planner.JointWaypoint(UR5E.middle + 0.2, transition=BlendTransition(0.05)),
        planner.JointWaypoint(UR5E.middle + np.linspace(0.5, -0.3, 6)),
    ]
    plan = optimised(planner.PlanningProblem(UR5E, waypoints), "trapezoidal", 8)
    assert plan.optimisation is not None
    assert not plan.optimisation.moved
    assert all(radius < 0.05 for radius in plan.optimisation.radii.values())


def test_the_time_budget_ends_the_optimisation() -> None:
    """It includes the first plan, and ends at most one iterate later."""
    problem = replace(through_poses(planner.load_robot("fr3"), 2, 3), optimise="duration", time_budget=0.4)
    planner.plan(problem, "trapezoidal")
    begun = monotonic()
    report = planner.plan(problem, "trapezoidal").optimisation
    assert monotonic() - begun < 20.0
    assert report is not None
    assert report.iterates > 0


@pytest.mark.parametrize(
    ("more", "field"),
    [
        ({"optimise": "effort"}, "optimise"),
        ({"optimise": "duration", "duration": 5.0}, "optimise"),
        ({"time_budget": 1.0}, "time_budget"),
        ({"optimise": "duration", "time_budget": 0.0}, "time_budget"),
        ({"optimise": "duration", "optimise_iterates": 0}, "optimise_iterates"),
    ],
)
def test_contradictory_options_are_refused(more: dict[str, object], field: str) -> None:
    """The refusal names the field."""
    with pytest.raises(InvalidProblem) as refused:
        planner.plan(replace(through_poses(UR5E, 0, 1), **more), "cubic")  # type: ignore[arg-type]
    assert [fault.field for fault in refused.value.faults] == [(field,)]


@pytest.mark.large_only
def test_relative_waypoints_follow_a_moved_one() -> None:
    """A relative waypoint behind a region starts from the pose to which its waypoint moved."""
    problem = through_poses(UR5E, 3, 1, ThroughTransition(), REGION)
    move = planner.RelativeWaypoint(planner.CartesianMove((0.0, 0.0, -0.03)), transition=StopTransition())
    first, pose, last = problem.waypoints
    whole = replace(problem, waypoints=(first, pose, move, last))
    plan = optimised(whole, "toppra", 10)
    reached = [planner.forward_kinematics(UR5E, plan.trajectory.at_arrivals[k]) for k in (1, 2)]
    expected = reached[0].position + reached[0].rotation @ [0.0, 0.0, -0.03]
    assert reached[1].position == pytest.approx(expected, abs=1e-5)
