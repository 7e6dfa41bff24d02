"""The kernel beside the package toppra: equal durations, certificates and refusals, on every kind of path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.corpus.corpus import VARIANTS, back_ends_of, job, suite
from planner.backends import Toppra
from planner.backends.toppra.profile import NEGLECTED
from planner.errors import LimitsUnsatisfiable, PlanningError
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import PlanningProblem
from planner.problems.transitions import BlendTransition, StopTransition
from planner.robots import load_robot
from tests.planner.backends.toppra.toppra_problems import (
    KUKA,
    KUKA_START,
    joint_problem,
    robot_limits,
    through,
    tool_problem,
)
from tests.sizes import SIZE

KERNEL, PACKAGE = Toppra(), Toppra(solver="package")

EQUAL = 1e-5
"""Relative difference of durations that count as equal. Intervals are split again where that may gain `NEGLECTED`. A
plan whose intervals are split gains that much over one whose intervals just are not."""


def outcome(problem: PlanningProblem, backend: Toppra) -> Plan | PlanningError:
    try:
        return plan(problem, backend)
    except PlanningError as refusal:
        return refusal


def planned_alike(problem: PlanningProblem, equal: float = EQUAL) -> tuple[Plan, Plan] | None:
    """Plan with both solvers: return equal and satisfied plans, or None where both refuse for the same reason."""
    kernel, package = outcome(problem, KERNEL), outcome(problem, PACKAGE)
    if isinstance(kernel, PlanningError) or isinstance(package, PlanningError):
        assert isinstance(kernel, PlanningError)
        assert isinstance(package, PlanningError)
        assert [kernel.code, kernel.waypoint, kernel.segment] == [package.code, package.waypoint, package.segment]
        return None
    same_grid = len(kernel.trajectory.lengths) == len(package.trajectory.lengths)
    tolerance = equal if same_grid else NEGLECTED
    assert kernel.trajectory.duration == pytest.approx(package.trajectory.duration, rel=tolerance)
    assert kernel.certificate.satisfied
    assert package.certificate.satisfied
    return kernel, package


def of_every_family() -> list[str]:
    """List jobs of the corpus: one of each family in the quick suite, else all planned by the tests."""
    names = [name for name in suite() if "toppra" in back_ends_of(name)]
    if SIZE.one_in == 1:
        return names
    return [next(name for name in names if name.startswith(f"{family}-")) for family in VARIANTS if family in KNOWN]


KNOWN = {name.split("-")[0] for name in suite() if "toppra" in back_ends_of(name)}


@pytest.mark.sized
@pytest.mark.parametrize("name", of_every_family())
def test_every_family_of_paths_takes_the_same_time(name: str) -> None:
    planned_alike(job(name).problem)


def line(*positions: float, scale: float = 1.0) -> PlanningProblem:
    """Return a problem that moves one joint to and fro, and the others with it."""
    return joint_problem(KUKA, [[scale * q * (k + 1) / 6.0 for k in range(6)] for q in positions])


STRUCTURED = {
    "straight": line(0.0, 0.2, 0.5, 0.6),
    "to and fro": line(0.0, 0.5, 0.1, 0.7),
    "repeated points": line(0.0, 0.3, 0.3, 0.3, 0.6),
    "nearly repeated points": line(0.0, 0.3, 0.3 + 1e-9, 0.6),
    "tiny": line(0.0, 0.2, 0.5, 0.1, scale=1e-6),
    "far": joint_problem("ngv_refuelling_arm", [[50.0 * q] * 6 for q in (0.0, 2.0, -1.0, 3.0)]),
    "slow": replace(line(0.0, 0.5, 0.1, 0.7), limits=Limits(velocity_scale=1e-3, acceleration_scale=1e-3)),
    "through": through("ngv_refuelling_arm", 6, 8, 0.5),
    "one degree of three": through("three_dof_arm", 4, 7, 1.0),
    "stops of the tool": tool_problem(StopTransition()),
    "blends of the tool": tool_problem(BlendTransition(0.05)),
    "tool speed": tool_problem(BlendTransition(0.05), limits=Limits(tcp_linear_velocity=0.1)),
    "tool acceleration": tool_problem(BlendTransition(0.05), limits=Limits(tcp_linear_acceleration=0.5)),
    "torque": joint_problem(
        KUKA,
        [list(KUKA_START), [-1.0, -0.6, 0.9, 1.0, -0.5, 1.0], [0.5, -1.0, 1.2, 0.0, 0.4, 0.0]],
        limits=robot_limits(load_robot(KUKA), 0.3),
    ),
}


@pytest.mark.long_table
@pytest.mark.parametrize("kind", STRUCTURED)
def test_structured_paths_take_the_same_time(kind: str) -> None:
    assert planned_alike(STRUCTURED[kind]) is not None


@pytest.mark.large_only
def test_dense_points_take_the_same_time() -> None:
    """Every run of the tests has 200 waypoints, CI has 1,000.

    With 20,000 intervals one or the other exceeds a limit between its gridpoints, by up to 5e-5, and slows the whole.
    """
    count = 1000 if SIZE.one_in == 1 else 200
    s = np.linspace(0.0, 1.0, count)
    positions = np.array(KUKA_START) + 0.4 * np.array([np.sin((k + 1) * s * 2.0) for k in range(6)]).T
    assert planned_alike(joint_problem(KUKA, positions.tolist()), equal=1e-4) is not None


@pytest.mark.parametrize("seed", range(3))
def test_random_waypoints_take_the_same_time(seed: int) -> None:
    robot_id = ("kuka_kr16_l6_2", "ngv_refuelling_arm", "date_sorting_arm")[seed]
    assert planned_alike(through(robot_id, 20 + seed, 6, 0.4)) is not None


def test_torques_below_gravity_are_refused_by_both() -> None:
    problem = replace(STRUCTURED["torque"], limits=robot_limits(load_robot(KUKA), 0.05))
    assert isinstance(outcome(problem, KERNEL), LimitsUnsatisfiable)
    assert planned_alike(problem) is None


def test_durations_too_short_are_refused_with_the_same_remedy() -> None:
    problem = tool_problem(StopTransition())
    waypoints = [replace(waypoint, duration=0.01 if k == 1 else None) for k, waypoint in enumerate(problem.waypoints)]
    problem = replace(problem, waypoints=tuple(waypoints))
    remedies = []
    for backend in (KERNEL, PACKAGE):
        refusal = outcome(problem, backend)
        assert isinstance(refusal, PlanningError)
        remedies.append(refusal.remedies[0].value)
    assert remedies[0] == pytest.approx(remedies[1], rel=EQUAL)


def test_torques_that_gravity_nearly_takes_bind_at_rest() -> None:
    """Bisection finds limits at which a joint just holds its load; a little above, both solvers still move alike."""
    low, high = 0.05, 0.3
    for _ in range(6):
        middle = (low + high) / 2.0
        limits = robot_limits(load_robot(KUKA), middle)
        refused = isinstance(outcome(replace(STRUCTURED["torque"], limits=limits), KERNEL), PlanningError)
        low, high = (middle, high) if refused else (low, middle)
    assert planned_alike(replace(STRUCTURED["torque"], limits=robot_limits(load_robot(KUKA), high))) is not None


def test_the_plan_says_what_computed_its_profile() -> None:
    curve = STRUCTURED["through"]
    assert plan(curve, KERNEL).trajectory.solver == "kernel"
    assert plan(curve, PACKAGE).trajectory.solver == "package"
    assert plan(curve, Toppra(jerk_limited=True)).trajectory.solver is None
    straight = joint_problem("ngv_refuelling_arm", [[0.0] * 6, [0.5] * 6])
    assert plan(straight, PACKAGE).trajectory.solver is None
    line_of_the_tool = STRUCTURED["stops of the tool"]
    assert plan(line_of_the_tool, PACKAGE).trajectory.solver == "package"
