"""Samples of plans on controllers: the plan's claims against a check of the samples, and against scipy."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicHermiteSpline

from planner.backends import BACKENDS, Ruckig, Toppra
from planner.certificate.checks import Certificate
from planner.certificate.samples import INTERPOLATIONS, certify_samples
from planner.certificate.sampling import certify_sampling, worst_overshoot
from planner.certificate.trajectories import certify_polynomials
from planner.errors import PlanningError
from planner.guarantees import end_states
from planner.limits import TCP_QUANTITIES, Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import load_robot
from tests.planner.problems_of_tests import backend_of, path_problems, problem_of, problems

SAMPLED = {"torque", *TCP_QUANTITIES}
"""Quantities whose peaks are sampled, at other points where pieces are cut at the segments."""


def says_the_same(said: Certificate, found: Certificate) -> None:
    """Assert that the verdicts agree, and so do all ratios."""
    assert said.satisfied == found.satisfied
    for ours, theirs in zip(said.checks, found.checks, strict=True):
        assert (ours.quantity, ours.enforced, ours.bounded) == (theirs.quantity, theirs.enforced, theirs.bounded)
        tolerance = 0.1 if ours.quantity in SAMPLED else 1e-7
        if ours.ratio is None or theirs.ratio is None:
            assert ours.ratio is theirs.ratio
        else:
            assert ours.ratio == pytest.approx(theirs.ratio, rel=tolerance, abs=1e-12)


def agrees_with_its_samples(result: Plan, period: float) -> None:
    """Assert that a check of the plan's samples agrees with its claim for each interpolation.

    The certificate of its polynomials is satisfied.
    """
    robot, trajectory, limits = result.path.robot, result.trajectory, result.problem.limits
    ends = end_states(result.backend, robot.dof)
    time = trajectory.sample_times(period)
    rows = trajectory.evaluate(time)
    for said in certify_sampling(result.path.dynamics, trajectory, result.path.limits, time, ends):
        found = certify_samples(robot, time, *rows, limits, interpolation=said.interpolation, ends=ends)
        says_the_same(said.certificate, found)
    assert certify_polynomials(robot, trajectory, limits=limits, ends=ends).satisfied


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
@settings(max_examples=max(8, settings.default.max_examples // 60))
@given(data=st.data())
def test_samples_of_every_plan_are_validated_as_the_plan_says(kind: str, data: st.DataObject) -> None:
    problem = data.draw(st.one_of(problems(kind), path_problems(kind)))
    # Validated samples have the limits of the whole trajectory only, and one payload and tool throughout.
    alike = {"limits": None, "payload": None, "put_down": False, "tool": None}
    waypoints = tuple(replace(waypoint, **alike) for waypoint in problem.waypoints)
    # The centripetal acceleration of a tool almost at rest peaks in an instant, which samples may miss.
    limits = replace(problem.limits, tcp_centripetal_acceleration=None)
    try:
        result = plan(replace(problem, waypoints=waypoints, limits=limits), backend_of(kind))
    except PlanningError:  # a path of the tool that cannot be followed
        return
    agrees_with_its_samples(result, result.trajectory.duration / data.draw(st.sampled_from([1.0, 7.3, 50.0, 311.7])))


STRUCTURED = {
    "nothing moves": [[0.1, -1.2, 1.4, 0.0, 0.3, 0.0]] * 2,
    "one joint moves": [[0.0, -1.2, 1.4, 0.0, 0.3, 0.0], [0.5, -1.2, 1.4, 0.0, 0.3, 0.0]],
    "there and back": [[0.0, -1.2, 1.4, 0.0, 0.3, 0.0], [0.5, -1.2, 1.4, 0.1, 0.3, 0.0], [0.0, -1.2, 1.4, 0, 0.3, 0]],
    "all joints alike": [[0.1] * 6, [0.3] * 6],
    "a microradian": [[0.1, -1.2, 1.4, 0.0, 0.3, 0.0], [0.1 + 1e-6, -1.2, 1.4, 0.0, 0.3, 0.0]],
}


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
@pytest.mark.parametrize("case", STRUCTURED)
def test_samples_of_structured_plans_are_validated_as_the_plan_says(kind: str, case: str) -> None:
    robot = load_robot("kuka_kr16_l6_2")
    waypoints = tuple(JointWaypoint(position=tuple(map(float, q))) for q in STRUCTURED[case])
    try:
        result = plan(PlanningProblem(robot, waypoints), backend_of(kind))
    except PlanningError:
        assert case == "nothing moves"
        return
    for period in (0.01, 0.1):
        agrees_with_its_samples(result, period)


@pytest.mark.parametrize("kind", ["ruckig", "toppra", "quintic"])
def test_the_ratios_are_those_of_the_splines_of_scipy(kind: str) -> None:
    result = plan(problem_of("kuka_kr16_l6_2", 3, 4, 0.3), backend_of(kind))
    robot, trajectory = result.path.robot, result.trajectory
    time = trajectory.sample_times(0.02)
    q, v, a = trajectory.evaluate(time)
    splines = {
        "cubic": CubicHermiteSpline(time, q, v),
        "quintic": BPoly.from_derivatives(time, np.stack([q, v, a], axis=1)),
    }
    # Just within each interval: at its ends a derivative may have two values.
    dense = np.concatenate([np.linspace(s + 1e-9, e - 1e-9, 60) for s, e in pairwise(time)])
    for said in certify_sampling(result.path.dynamics, trajectory, result.path.limits, time)[1:]:
        for order, quantity in enumerate(("velocity", "acceleration", "jerk"), 1):
            [check] = [check for check in said.certificate.checks if check.quantity == quantity]
            if check.ratio is None:
                continue
            peaks = np.abs(splines[said.interpolation].derivative(order)(dense)).max(axis=0)
            assert check.ratio == pytest.approx(float((peaks / robot.limit(quantity)).max()), rel=1e-3)


def test_limits_are_those_in_force_at_each_time() -> None:
    """A segment with 10 % of the velocity limit keeps it; a plan that is faster elsewhere is no failure."""
    problem = problem_of("kuka_kr16_l6_2", 5, 3, 0.3)
    slow = Limits(velocity_scale=0.1)
    waypoints = (*problem.waypoints[:2], replace(problem.waypoints[2], limits=slow))
    result = plan(replace(problem, waypoints=waypoints), Ruckig())
    robot, trajectory = result.path.robot, result.trajectory
    time = trajectory.sample_times(0.01)
    linear = certify_sampling(result.path.dynamics, trajectory, result.path.limits, time)[0].certificate
    assert linear.satisfied
    [velocity] = [check for check in linear.checks if check.quantity == "velocity"]
    rows, lengths = trajectory.evaluate(time, [0])[0], np.diff(time)[:, None]
    in_slow = np.flatnonzero(time[:-1] >= trajectory.departures[1])
    speeds = np.abs(np.diff(rows, axis=0) / lengths) / robot.limit("velocity")
    speeds[in_slow] *= 10.0
    assert velocity.ratio == pytest.approx(float(speeds.max()), rel=1e-9)
    assert not certify_samples(robot, time, rows, limits=slow).satisfied


def test_toppra_and_ruckig_overshoot_as_seen_over_http() -> None:
    """The figures of the issue: steps exceed limits between samples, cubics by two thirds at most."""
    problem = problem_of("kuka_kr16_l6_2", 1, 4, 0.5)
    ratios = {}
    for backend in (Toppra(), Ruckig()):
        result = plan(problem, backend)
        time = result.trajectory.sample_times(0.01)
        for said in certify_sampling(result.path.dynamics, result.trajectory, result.path.limits, time):
            for check in said.certificate.checks:
                ratios[backend.kind, said.interpolation, check.quantity] = check.ratio or 0.0
    assert 1.05 < ratios["toppra", "cubic", "acceleration"] <= 5.0 / 3.0 + 1e-6
    assert ratios["toppra", "quintic", "acceleration"] > 1.05
    assert ratios["ruckig", "quintic", "jerk"] > 1.2
    assert ratios["ruckig", "cubic", "acceleration"] < 1.05
    for kind in ("toppra", "ruckig"):
        assert ratios[kind, "linear", "velocity"] <= 1.0 + 1e-9


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
@pytest.mark.parametrize("period", [0.01, 0.05, 0.3, 2.0])
def test_the_worst_overshoot_is_that_of_the_exact_check(kind: str, period: float) -> None:
    result = plan(problem_of("kuka_kr16_l6_2", 7, 4, 0.4), backend_of(kind))
    robot, trajectory = result.path.robot, result.trajectory
    time = trajectory.sample_times(period)
    q, v = trajectory.evaluate(time, [0, 1])
    cubic = certify_samples(robot, time, q, v)
    for quantity in ("velocity", "acceleration"):
        [check] = [check for check in cubic.checks if check.quantity == quantity]
        found = worst_overshoot(trajectory, result.path.limits, time, q, v, [quantity])
        assert check.ratio is not None
        if found is None:
            assert check.ratio <= 1.01
            continue
        assert found.ratio == pytest.approx(check.ratio, rel=1e-9)
        assert robot.joint_names[found.joint] == check.joint
        assert found.time <= check.time <= found.time + period * (1.0 + 1e-9)


def test_a_start_in_motion_validates_where_it_is_told() -> None:
    problem = problem_of("kuka_kr16_l6_2", 2, 2, 0.3)
    result = plan(problem, Ruckig(initial_velocity=(0.1, 0.0, 0.05, 0.0, 0.0, 0.0)))
    robot, trajectory = result.path.robot, result.trajectory
    ends = end_states(result.backend, robot.dof)
    assert certify_polynomials(robot, trajectory, ends=ends).satisfied
    assert not certify_polynomials(robot, trajectory).satisfied
    agrees_with_its_samples(result, 0.01)


def test_every_interpolation_is_said_in_order() -> None:
    result = plan(problem_of("three_dof_arm", 1, 2))
    said = certify_sampling(
        result.path.dynamics, result.trajectory, result.path.limits, result.trajectory.sample_times(0.01)
    )
    assert tuple(one.interpolation for one in said) == INTERPOLATIONS
