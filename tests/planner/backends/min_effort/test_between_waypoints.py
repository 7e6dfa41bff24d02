"""Minimum effort against differences, the quintic, a second formulation and dense samples."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.interpolate import make_interp_spline
from scipy.linalg import null_space
from scipy.optimize import minimize

from benchmarks.corpus.promises import keeps_joint_limits, keeps_sampled_limits
from planner.backends import MinEffort, Quintic
from planner.backends.min_effort import optimum
from planner.backends.min_effort.cost import Objective
from planner.backends.min_effort.numbers import Layout
from planner.backends.min_effort.optimum import MOST_WORK
from planner.backends.min_effort.options import MOST_SPLINE_KNOTS
from planner.backends.min_effort.program import Motion, Program, program_of
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, InvalidProblem, MissingDynamics
from planner.kinematics import FloatArray, tool_speeds
from planner.last_used import LastUsed
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.robots import ExternalAxis, Robot, load_robot
from planner.robots.payload import Payload
from tests.planner.problems_of_tests import problem_of

ARM = "kuka_kr16_l6_2"
QUICK = MinEffort(knots=24, max_deviation=None)
"""The path is free: bounds on it have tests of their own."""


def arm_problem(seed: int, count: int, scale: float = 1.0, through: bool = False) -> PlanningProblem:
    problem = problem_of(ARM, seed, count, scale)
    if not through:
        return problem
    first, *inner, last = problem.waypoints
    passed = [replace(waypoint, transition=ThroughTransition()) for waypoint in inner]
    return replace(problem, waypoints=(first, *passed, last))


def with_durations(problem: PlanningProblem, durations: list[float | None]) -> PlanningProblem:
    first, *others = problem.waypoints
    timed = [replace(waypoint, duration=seconds) for waypoint, seconds in zip(others, durations, strict=True)]
    return replace(problem, waypoints=(first, *timed))


def effort_of_states(robot: Robot, times: FloatArray, states: list[FloatArray]) -> float:
    torques = inverse_dynamics(robot, *states)
    return float(np.trapezoid(((torques / robot.limit("torque")) ** 2).sum(axis=1), times))


def effort(result: Plan) -> float:
    times = np.linspace(0.0, result.trajectory.duration, 4001)
    return effort_of_states(result.path.robot, times, result.trajectory.evaluate(times))


def by_differences(function: Any, x: FloatArray, step: float = 1e-6) -> FloatArray:
    """Compute the derivatives (outputs, len(x)) by central differences."""
    steps = step * np.eye(len(x))
    columns = [(np.array(function(x + d)) - np.array(function(x - d))).ravel() / (2.0 * step) for d in steps]
    return np.array(columns).T


@pytest.mark.long_table
@pytest.mark.parametrize("limited", [(False, False, False), (True, True, True)])
@pytest.mark.parametrize("objective", ["effort", "mechanical_work", "jerk"])
def test_derivatives_by_differences(objective: Objective, limited: tuple[bool, bool, bool]) -> None:
    """The gradient and the second derivatives of constraints and Lagrangian agree with differences, durations included.

    The constraints are torques and their rates, or also the tool's speed and the distances of tool and joints from a
    path.
    """
    program = Program(load_robot(ARM), Layout(2, 4, objective, *limited))
    values, slopes, curvature = (
        program.solver.get_function(name) for name in ("nlp_grad_f", "nlp_jac_g", "nlp_hess_l")
    )
    rng = np.random.default_rng(3)
    x = rng.uniform(-0.5, 0.5, slopes.size1_in(0))
    x[-2:] = 0.8, 1.3
    p = rng.uniform(0.5, 1.5, slopes.size1_in(1))
    factor, multipliers = 0.7, rng.uniform(-1.0, 1.0, slopes.size1_out(0))
    gradient, jacobian = np.array(values(x, p)[1]), np.array(slopes(x, p)[1])
    by_f = by_differences(lambda x: values(x, p)[0], x)
    by_g = by_differences(lambda x: slopes(x, p)[0], x)
    assert np.abs(gradient.ravel() - by_f.ravel()).max() <= 1e-7 * max(1.0, np.abs(by_f).max())
    assert np.abs(jacobian - by_g).max() <= 1e-7 * np.abs(by_g).max()

    def lagrangian_slope(x: FloatArray) -> FloatArray:
        slope: FloatArray = factor * np.array(values(x, p)[1]).ravel() + multipliers @ np.array(slopes(x, p)[1])
        return slope

    upper = np.array(curvature(x, p, factor, multipliers))
    whole = np.triu(by_differences(lagrangian_slope, x))
    assert np.abs(upper - whole).max() <= 1e-6 * np.abs(whole).max()


@pytest.mark.long_table
@pytest.mark.parametrize("through", [False, True], ids=["stop", "through"])
@pytest.mark.parametrize("seed", range(4))
def test_effort_is_never_above_the_quintics(seed: int, through: bool) -> None:
    problem = arm_problem(seed, 3, 0.3, through)
    quintic, best = plan(problem, Quintic()), plan(problem, QUICK)
    assert best.trajectory.duration == pytest.approx(quintic.trajectory.duration, rel=1e-9)
    assert effort(best) < 0.99 * effort(quintic)
    assert {warning.code for warning in best.warnings} <= {"tool_deviates", "joint_deviates"}


@pytest.mark.long_table
@pytest.mark.parametrize("seed", [2, 3, 4, 6, 7, 9, 12, 13, 14, 15, 16, 17])
def test_a_second_formulation_finds_the_same_optimum(seed: int) -> None:
    """The unknowns are accelerations, integrated twice, by BFGS with Pinocchio's derivatives.

    Limits are too wide to bind. Effort has many local minima: the search begins beside the minimum that it confirms.
    """
    duration, pieces = 0.5, 16
    problem = with_durations(arm_problem(seed, 2, 0.4), [duration])
    wide = {"lower": -np.inf, "upper": np.inf, "velocity": 1e3, "acceleration": 1e4, "jerk": 1e6}
    joints = tuple(replace(joint, **wide) for joint in problem.robot.joints)  # type: ignore[arg-type]
    problem = replace(problem, robot=replace(problem.robot, joints=joints))
    result = plan(problem, MinEffort(knots=pieces, max_deviation=None))
    assert all(check.ratio is None or check.ratio < 0.97 for check in result.certificate.checks)
    robot, (start, end) = problem.robot, result.path.positions
    nodes, times = np.linspace(0.0, duration, pieces + 1), np.linspace(0.0, duration, 4 * pieces + 1)
    hats = make_interp_spline(nodes, np.eye(pieces + 1)[:, 1:-1], k=1)
    bases = [hats.antiderivative(2)(times), hats.antiderivative()(times), hats(times)]
    arrival = np.array([bases[0][-1], bases[1][-1]])  # of position and velocity
    begin = np.linalg.pinv(arrival) @ np.array([end - start, np.zeros(robot.dof)])
    free = null_space(arrival)
    trapezoid = np.full(len(times), times[1])
    trapezoid[[0, -1]] /= 2.0
    weights = trapezoid / robot.limit("torque")[:, None] ** 2

    def cost(flat: FloatArray) -> tuple[float, FloatArray]:
        unknown = begin + free @ flat.reshape(-1, robot.dof)
        value, slope = 0.0, np.zeros_like(unknown)
        q, v, a = (basis @ unknown for basis in bases)
        for i, state in enumerate(zip(q + start, v, a, strict=True)):
            pin.computeRNEADerivatives(robot.model, robot.data, *state)
            pull = 2.0 * weights[:, i] * robot.data.tau
            by_acceleration = np.triu(robot.data.M) + np.triu(robot.data.M, 1).T
            value += float(pull @ robot.data.tau) / 2.0
            for basis, derivative in zip(bases, (robot.data.dtau_dq, robot.data.dtau_dv, by_acceleration), strict=True):
                slope += np.outer(basis[i], pull @ derivative)
        return value, (free.T @ slope).ravel()

    own = (free.T @ (result.trajectory.evaluate(nodes[1:-1], [2])[0] - begin)).ravel()
    expected, unit = effort(result), float(np.abs(own).max())
    assert cost(own)[0] == pytest.approx(expected, rel=0.01)
    beside = own + np.random.default_rng(seed).normal(0.0, 0.05 * unit, own.shape)
    assert cost(beside)[0] > 1.05 * expected

    def scaled(x: FloatArray) -> tuple[float, FloatArray]:
        value, slope = cost(x * unit)
        return value / expected, slope * unit / expected

    found = minimize(scaled, beside / unit, jac=True, method="BFGS", options={"maxiter": 250, "gtol": 1e-4})
    assert found.fun == pytest.approx(1.0, rel=0.01)


@pytest.mark.large_only
def test_limits_by_dense_samples() -> None:
    """Torque and tool speed are limited too, both narrow enough to bind."""
    limits = Limits(
        torque=tuple((0.3 * load_robot(ARM).limit("torque")).tolist()),
        tcp_linear_velocity=1.0,
        tcp_angular_velocity=2.0,
    )
    problem = replace(arm_problem(1, 4, 0.5, through=True), limits=limits)
    result = plan(problem, QUICK)
    robot, trajectory, bounds = result.path.robot, result.trajectory, result.path.limits
    times = np.linspace(0.0, trajectory.duration, 20001)
    q, v, a, j = trajectory.evaluate(times, [0, 1, 2, 3])
    linear, angular = tool_speeds(robot, q, v)
    used = [
        np.abs(v) / bounds.velocity.narrower[0],
        np.abs(a) / bounds.acceleration.narrower[0],
        np.abs(j) / bounds.jerk.narrower[0],
        np.abs(inverse_dynamics(robot, q, v, a)) / bounds.torque.narrower[0],
        linear / 1.0,
        angular / 2.0,
    ]
    assert all(use.max() <= 1.0 + 1e-9 for use in used)
    assert max(used[3].max(), used[4].max(), used[5].max()) > 0.98
    assert (q >= bounds.position.lower).all()
    assert (q <= bounds.position.upper).all()
    assert np.abs(trajectory.evaluate(trajectory.arrivals, [0])[0] - result.path.positions).max() <= 1e-9
    for derivative in trajectory.evaluate(np.array([0.0, trajectory.duration]), [1, 2]):
        assert np.abs(derivative).max() <= 1e-9
    quintic = plan(problem, Quintic())
    assert effort(result) < effort(quintic)


@pytest.mark.large_only
def test_without_inertias_effort_is_unknown() -> None:
    problem = problem_of("ngv_refuelling_arm", 1, 2)
    with pytest.raises(MissingDynamics):
        plan(problem, QUICK)
    result = plan(problem, MinEffort(objective="jerk", knots=16))
    assert result.trajectory.duration == pytest.approx(plan(problem, Quintic()).trajectory.duration)


def test_where_nothing_takes_a_torque_nothing_is_saved() -> None:
    """An arm without masses stands on a table that turns about its own centre of mass."""
    table = ExternalAxis("table", "revolute", (0.0, 0.0, 1.0), lower=-1.0, upper=2.0, velocity=1.0, mass=60.0)
    robot = load_robot("date_sorting_arm").derived(id="on_a_table", external_axes=[table])
    waypoints = tuple(JointWaypoint(position=tuple(robot.middle + way)) for way in (0.0, 0.02))
    problem = PlanningProblem(robot, waypoints, limits=Limits(torque=(1e4,) * robot.dof))
    result = plan(problem, QUICK)
    assert result.certificate.satisfied
    assert result.trajectory.duration == pytest.approx(plan(problem, Quintic()).trajectory.duration, rel=0.2)


@pytest.mark.large_only
def test_a_payload_changes_the_motion() -> None:
    problem = with_durations(arm_problem(2, 2, 0.5), [3.0])
    empty, loaded = plan(problem, QUICK), plan(replace(problem, payload=Payload(5.0, (0.0, 0.0, 0.1))), QUICK)
    middle = np.linspace(0.0, 3.0, 50)
    ways = [result.trajectory.evaluate(middle, [0])[0] for result in (empty, loaded)]
    assert np.abs(ways[0] - ways[1]).max() > 1e-3
    carried = effort_of_states(
        loaded.path.robot, np.linspace(0, 3, 4001), empty.trajectory.evaluate(np.linspace(0, 3, 4001))
    )
    assert effort(loaded) < carried


def test_asked_durations_are_kept_and_free_ones_found() -> None:
    free = arm_problem(1, 4, 0.3, through=True)
    quintic = plan(free, Quintic())
    times = np.diff(quintic.trajectory.arrivals).tolist()
    found, given = plan(free, QUICK), plan(with_durations(free, times), QUICK)
    assert np.diff(given.trajectory.arrivals) == pytest.approx(times, rel=1e-9)
    assert found.trajectory.duration == pytest.approx(sum(times), rel=1e-9)
    assert effort(found) < effort(given) < effort(quintic)


@pytest.mark.large_only
def test_a_duration_that_only_the_quintic_finds_too_short() -> None:
    free = arm_problem(1, 2)
    shortest = plan(free, Quintic()).trajectory.duration
    faster = plan(with_durations(free, [0.9 * shortest]), QUICK)
    assert faster.trajectory.duration == pytest.approx(0.9 * shortest, rel=1e-12)
    requested = with_durations(free, [0.3 * shortest])
    with pytest.raises(InfeasibleDuration) as refused:
        plan(requested, QUICK)
    assert (refused.value.segment, refused.value.joint) == (0, "joint_a4")
    remedy = refused.value.remedies[0]
    assert remedy.field == ("waypoints", 1, "duration")
    assert plan(with_durations(free, [remedy.value]), QUICK).trajectory.duration == remedy.value


@pytest.mark.large_only
def test_time_against_effort() -> None:
    def price(result: Plan, weight: float) -> float:
        return effort(result) + weight * result.trajectory.duration

    problem = arm_problem(0, 2)
    plans = {w: plan(problem, replace(QUICK, time_weight=w)) for w in (1e-3, 1.0)}
    assert plans[1.0].trajectory.duration < 0.9 * plans[1e-3].trajectory.duration
    for weight, result in plans.items():
        other = plans[1.0 if weight < 1.0 else 1e-3]
        assert price(result, weight) < price(other, weight)
        assert price(result, weight) < price(plan(problem, QUICK), weight)
    slow = plan(problem, replace(QUICK, slowdown=1.5))
    assert slow.trajectory.duration == pytest.approx(1.5 * plan(problem, QUICK).trajectory.duration)


@pytest.mark.long_table
@pytest.mark.parametrize("objective", ["mechanical_work", "jerk"])
def test_other_objectives(objective: Objective) -> None:
    problem = arm_problem(1, 3, 0.4, through=True)

    def cost(result: Plan) -> float:
        times = np.linspace(0.0, result.trajectory.duration, 4001)
        q, v, a, j = result.trajectory.evaluate(times, [0, 1, 2, 3])
        if objective == "jerk":
            return float(np.trapezoid(((j / result.path.robot.limit("jerk")) ** 2).sum(axis=1), times))
        return float(np.trapezoid(np.abs(inverse_dynamics(result.path.robot, q, v, a) * v).sum(axis=1), times))

    best = plan(problem, replace(QUICK, objective=objective))
    assert cost(best) < 0.999 * cost(plan(problem, Quintic()))
    assert cost(best) < cost(plan(problem, QUICK))


def test_after_its_iterations_the_best_motion_so_far_is_returned() -> None:
    problem = arm_problem(2, 2)
    hurried = plan(problem, replace(QUICK, iterations=1))
    assert [warning.code for warning in hurried.warnings] == ["suboptimal"]
    assert effort(hurried) <= effort(plan(problem, Quintic())) * (1.0 + 1e-9)


@pytest.mark.long_table
@pytest.mark.parametrize("through", [False, True], ids=["stop", "through"])
def test_without_a_search_it_is_the_quintic(through: bool) -> None:
    problem = arm_problem(2, 3, 0.3, through)
    begun, quintic = plan(problem, QUICK.without_search()), plan(problem, Quintic())
    assert begun.trajectory.coefficients == pytest.approx(quintic.trajectory.coefficients, rel=1e-12, abs=1e-9)
    assert [warning.code for warning in begun.warnings] == ["suboptimal"]


def test_fewer_intervals_for_a_short_duration_cost_little_effort() -> None:
    problem = arm_problem(2, 2, 0.8)
    default, fine = (plan(problem, MinEffort(knots=knots)) for knots in (None, MOST_SPLINE_KNOTS))
    assert len(default.trajectory.lengths) < MOST_SPLINE_KNOTS
    assert effort(default) <= 1.005 * effort(fine)


def test_programs_are_kept_for_robots_of_equal_content() -> None:
    robot, layout = load_robot(ARM), Layout(1, 9, "effort", False)
    program = program_of(robot.with_payload(Payload(1.0)), layout)
    assert program_of(robot.with_payload(Payload(1.0)), layout) is program
    assert program_of(robot.with_payload(Payload(2.0)), layout) is not program


def test_what_was_last_used_is_kept_while_it_fits() -> None:
    cache: LastUsed[int] = LastUsed(100, size_of=lambda value: value)
    for value in (10, 20, 30, 40, 20, 50, 101, 60):  # 101 is more than fits, and turns all others out
        assert cache.get(value, partial(int, value)) == value
    assert list(cache.kept) == [60]
    for value in (30, 10, 60, 5):
        assert cache.get(value, partial(int, value)) == value
    assert list(cache.kept) == [10, 60, 5]


def test_the_memory_of_a_program_grows_with_its_intervals() -> None:
    robot = load_robot(ARM)
    small, large = (Program(robot, Layout(segments, 8, "effort", True)).memory for segments in (2, 32))
    assert 10.0 < large / small < 24.0
    assert 2e7 < large < 1e8


def passed(count: int) -> PlanningProblem:
    """Return a problem with `count` waypoints on an arc, all passed except the first and the last."""
    angles = np.linspace(0.0, 2.0, count)
    positions = [(0.4 * np.sin(t), -1.5 + 0.3 * t, 1.5 + 0.1 * t * t, -1.5, -1.5, 0.5 * t) for t in angles]
    waypoints = [JointWaypoint(position=p, transition=ThroughTransition()) for p in positions]
    waypoints[0], waypoints[-1] = JointWaypoint(position=positions[0]), JointWaypoint(position=positions[-1])
    return PlanningProblem(load_robot("ur5"), waypoints)


def test_case_min_effort_500() -> None:
    """Too many waypoints passed at once took all memory of a worker; they are refused before anything is built."""
    with pytest.raises(InvalidProblem, match="at most 99 waypoints between two stops, and here are 298") as refusal:
        plan(passed(300), MinEffort())
    assert [fault.field for fault in refusal.value.faults] == [("waypoints", 100, "transition")]


def test_equal_problems_have_equal_plans_when_the_search_is_cut() -> None:
    """A search cut by the clock gave four different answers to equal requests."""
    cut = [plan(passed(8), MinEffort(iterations=5)) for _ in range(2)]
    assert [warning.code for warning in cut[0].warnings] == ["suboptimal"]
    assert np.array_equal(cut[0].trajectory.coefficients, cut[1].trajectory.coefficients)


@pytest.mark.large_only
def test_waypoints_under_a_tool_speed_take_a_bounded_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """With fifty of them the search took a minute and more."""
    problem, most, spent = replace(passed(24), limits=Limits(tcp_linear_velocity=0.05)), MOST_WORK // 40, []
    solve = Program.solve

    def counted(self: Program, *rest: Any) -> Motion | None:
        motion = solve(self, *rest)
        if motion is not None:
            spent.append(motion.iterations * optimum._work(self.layout))
        return motion

    monkeypatch.setattr(optimum, "MOST_WORK", most)
    monkeypatch.setattr(Program, "solve", counted)
    found = plan(problem, MinEffort())
    assert sum(spent) <= most + optimum._work(Layout(23, 8, "effort", True, True))
    assert [warning.code for warning in found.warnings] == ["suboptimal"]
    assert effort(found) <= effort(plan(problem, Quintic())) * (1.0 + 1e-9)


def test_nothing_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    plan(arm_problem(5, 2), QUICK)
    assert capfd.readouterr() == ("", "")


@pytest.mark.large_only
def test_a_tool_that_is_nearly_at_its_speed_limit_all_the_way_does_not_ask_for_ever_more_intervals() -> None:
    start = (1.8083773728974482, -2.704238176858446, 1.3282889853551905, 0.7462329409973796, -2.2505425693, -2.46108980)
    end = (-2.321607366040192, -0.1793599262010157, 2.4834490832868843, -2.3401206791464437, 0.361912734, -1.16440979)
    limits = Limits(tcp_angular_velocity=0.2, velocity_scale=0.5, acceleration_scale=0.14)
    waypoints = JointWaypoint(position=start), JointWaypoint(position=end)
    result = plan(PlanningProblem(load_robot(ARM), waypoints, limits=limits), MinEffort(knots=8))
    assert len(result.trajectory.lengths) <= 4 * 8


@pytest.mark.large_only
def test_more_intervals_after_narrower_limits() -> None:
    """A repair with a coarse excess used more intervals, but margins for fewer: an error of array shapes."""
    speeds = Limits(
        velocity_scale=0.18710678231918604,
        acceleration_scale=0.10080281942326491,
        tcp_linear_velocity=0.13782703913934743,
        tcp_angular_velocity=0.4872404483524742,
    )
    problem = problem_of(ARM, 35, 3, 0.7989328457903327)
    problem = replace(problem, limits=speeds)
    result = plan(problem, MinEffort(knots=5))
    assert result.certificate.satisfied
    keeps_joint_limits(result)
    keeps_sampled_limits(result)
