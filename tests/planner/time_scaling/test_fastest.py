"""The fastest jerk-limited time scaling along a curve: limits by dense samples, durations by independent optima."""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.backends.splines.group_timing import time_group as quintic_along
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, InvalidProblem, LimitsUnsatisfiable, PlanningError
from planner.kinematics.forward import tool_pose, tool_speeds
from planner.limits import Limits
from planner.paths import JointPath, SegmentGroup, solve_path
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    AnyWaypoint,
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    RelativeWaypoint,
)
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition
from planner.robots import Robot, load_robot
from planner.spatial import Pose
from planner.time_scaling.fastest import ENFORCED, near_limits, time_group
from planner.time_scaling.linear_limits import LinearLimits
from planner.trajectories.polynomials import SegmentedPolynomial, differentiate, horner

ROBOTS = ("kuka_kr16_l6_2", "date_sorting_arm", "three_dof_arm")
TORQUE_ARM = "kuka_kr16_l6_2"
DENSE = np.linspace(0.0, 1.0, 33)


def random_waypoints(robot: Robot, rng: np.random.Generator, kind: str) -> list[AnyWaypoint]:
    """Draw waypoints of one straight, linear or circular motion, or of several, blended or passed."""
    lower, upper = np.maximum(robot.limit("lower"), -np.pi), np.minimum(robot.limit("upper"), np.pi)

    def position(share: float) -> tuple[float, ...]:
        return tuple(((lower + upper) / 2.0 + share * (rng.random(robot.dof) - 0.5) * (upper - lower)).tolist())

    def move(length: float) -> tuple[float, float, float]:
        direction = rng.normal(size=3)
        x, y, z = (length * direction / np.linalg.norm(direction)).tolist()
        return x, y, z

    first = position(0.7)
    waypoints: list[AnyWaypoint] = [JointWaypoint(position=first)]
    count = int(rng.integers(2, 5)) if kind in ("blend", "through") else 1
    for k in range(count):
        transition = StopTransition() if k == count - 1 else ThroughTransition()
        if kind == "circular":
            here, chord = tool_pose(robot, np.array(first)).position, move(rng.uniform(0.05, 0.3))
            via = Pose(here + np.array(chord) / 2.0 + move(np.linalg.norm(chord) / 3.0))
            waypoint = RelativeWaypoint(frame="base", move=CartesianMove(chord), motion=CircularMotion(via))
        elif kind in ("linear", "blend"):
            move_along = CartesianMove(move(rng.uniform(0.05, 0.4)))
            waypoint = RelativeWaypoint(frame="base", move=move_along, motion=LinearMotion())
            transition = BlendTransition(rng.uniform(0.02, 0.08)) if k < count - 1 else transition
        else:
            waypoint = JointWaypoint(position=position(0.9))
        waypoints.append(replace(waypoint, transition=transition))
    return waypoints


def first_group(
    robot: Robot, waypoints: list[AnyWaypoint], limits: Limits | None = None
) -> tuple[JointPath, SegmentGroup]:
    path = solve_path(PlanningProblem(robot, tuple(waypoints), limits=limits or Limits()))
    return path, path.every_group[0]


def random_group(robot_id: str, kind: str, seed: int, limits: Limits | None = None) -> tuple[JointPath, SegmentGroup]:
    """Return the first of a seed's random segment groups that the arm can follow."""
    robot, rng = load_robot(robot_id), np.random.default_rng(seed)
    while True:
        try:
            return first_group(robot, random_waypoints(robot, rng, kind), limits)
        except PlanningError:
            continue


def sampled(pieces: SegmentedPolynomial) -> list[np.ndarray]:
    """Return position, velocity, acceleration and jerk (samples, pieces, joints), with both ends of all pieces."""
    tau = DENSE[:, None, None] * pieces.lengths[:, None]
    return [horner(differentiate(pieces.coefficients, k), tau) for k in range(4)]


def worst_ratio(path: JointPath, pieces: SegmentedPolynomial) -> float:
    _, *rates = sampled(pieces)
    limits = path.limits.of(pieces.segments)
    return max(
        float((np.abs(rate) / limit).max())
        for rate, limit in zip(
            rates, (limits.velocity.narrower, limits.acceleration.narrower, limits.jerk.narrower), strict=True
        )
    )


def assert_rest_to_rest(path: JointPath, group: SegmentGroup, pieces: SegmentedPolynomial) -> None:
    """Assert C2, rest at both ends (also in the direction of the curve), and every limit."""
    values = sampled(pieces)
    for order in range(3):
        largest = max(1.0, float(np.abs(values[order]).max()))
        assert np.abs(values[order][-1, :-1] - values[order][0, 1:]).max(initial=0.0) <= 1e-8 * largest
        if order > 0:
            assert np.abs(values[order][0, 0]).max() <= 1e-9 * largest
            assert np.abs(values[order][-1, -1]).max() <= 1e-9 * largest
    ends = group.curve.evaluate(np.array([0.0, group.curve.breakpoints[-1]]), [0])[0]
    assert np.abs(values[0][[0, -1], [0, -1]] - ends).max() <= 1e-9
    dense = group.curve.evaluate(np.linspace(0.0, group.curve.breakpoints[-1], 20001), [0])[0]
    for q in values[0].reshape(-1, values[0].shape[2])[::101]:
        assert np.abs(dense - q).max(axis=1).min() <= group.tolerance + np.abs(np.diff(dense, axis=0)).max()
    assert worst_ratio(path, pieces) <= 1.0 + 1e-9


@pytest.mark.long_table
@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize("kind", ["straight", "linear", "circular", "blend", "through"])
@settings(max_examples=2, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_limits_of_all_orders_are_kept_and_one_is_used_in_full(robot_id: str, kind: str, seed: int) -> None:
    path, group = random_group(robot_id, kind, seed)
    pieces = time_group(path, group)
    assert_rest_to_rest(path, group, pieces)
    assert worst_ratio(path, pieces) >= 0.999 or path.robot.has_dynamics
    assert np.array_equal(time_group(path, group).coefficients, pieces.coefficients)

    # No time scaling is faster than the velocity limits everywhere; a quintic along the same curve is slower.
    slopes = horner(differentiate(group.curve.coefficients), DENSE[:, None, None] * group.curve.lengths[:, None])
    shares = (np.abs(slopes) / path.limits.velocity.narrower[group.curve.segments]).max(axis=2)
    assert pieces.lengths.sum() >= float(shares.min(axis=0) @ group.curve.lengths)
    if not group.is_spline and group.curve.lengths.min() > 1e-6:  # the quintic needs intervals that have a length
        assert pieces.lengths.sum() <= quintic_along(path, group, 5, ENFORCED).lengths.sum()


@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize("scale", [1.0, 0.1, 1e-3])
def test_a_straight_motion_takes_the_time_that_ruckig_needs(robot_id: str, scale: float) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(3)
    start, end = (np.array(random_waypoints(robot, rng, "straight")[0].position) for _ in range(2))
    end = start + scale * (end - start)
    waypoints: list[AnyWaypoint] = [JointWaypoint(position=tuple(q.tolist())) for q in (start, end)]
    path, group = first_group(robot, waypoints)
    ask, trajectory = ruckig.InputParameter(1), ruckig.Trajectory(1)
    ask.target_position = [1.0]
    for quantity in ("velocity", "acceleration", "jerk"):
        setattr(ask, f"max_{quantity}", [float((path.limits.magnitudes(quantity)[0] / np.abs(end - start)).min())])
    ruckig.Ruckig(1).calculate(ask, trajectory)
    duration = time_group(path, group).lengths.sum()
    assert trajectory.duration * (1.0 - 1e-6) <= duration <= trajectory.duration * 1.01


def fine_optimum(path: JointPath, group: SegmentGroup, count: int) -> float:
    """Compute the duration of the fastest piecewise cubic s(t) with fixed knots, by IPOPT; without tool and torque."""
    curve, length = group.curve, group.curve.breakpoints[-1]
    u = np.linspace(0.0, 1.0, count + 1)
    places = np.union1d(length * u**3 * (10.0 - 15.0 * u + 6.0 * u**2), curve.breakpoints)
    places = places[np.append(True, np.diff(places) > 1e-9 * length)]
    places[-1] = length
    gaps, knots = np.diff(places), len(places)
    opti = casadi.Opti()
    v, a, h, j = opti.variable(knots), opti.variable(knots), opti.variable(knots - 1), opti.variable(knots - 1)
    opti.subject_to(casadi.vertcat(v[0], a[0], v[-1], a[-1]) == 0.0)
    opti.subject_to((v[:-1] * h + a[:-1] * h**2 / 2.0 + j * h**3 / 6.0) / gaps == 1.0)
    opti.subject_to(v[1:] == v[:-1] + a[:-1] * h + j * h**2 / 2.0)
    opti.subject_to(a[1:] == a[:-1] + j * h)
    opti.subject_to(h >= 1e-6)
    opti.subject_to(v[1:-1] >= 1e-6)
    middles = (places[:-1] + places[1:]) / 2.0
    on = curve.locate(middles)[0]
    limits = path.limits.of(group.curve.segments[on])
    for side in (0, 1):
        at = (places[side : knots - 1 + side] - curve.breakpoints[on])[:, None]
        dq, ddq, dddq = (horner(curve.derivative_coefficients(k)[on], at) for k in (1, 2, 3))
        speed, gain = v[side : knots - 1 + side], a[side : knots - 1 + side]
        for joint in range(dq.shape[1]):
            one, two, three = dq[:, joint], ddq[:, joint], dddq[:, joint]
            rates = (
                one * speed / limits.velocity.narrower[:, joint],
                (two * speed**2 + one * gain) / limits.acceleration.narrower[:, joint],
                (three * speed**3 + 3.0 * two * speed * gain + one * j) / limits.jerk.narrower[:, joint],
            )
            for rate in rates:
                opti.subject_to(opti.bounded(-1.0, rate, 1.0))
    opti.minimize(casadi.sum1(h))
    slow, t = 3.0 * length, np.interp(places, length * u**3 * (10.0 - 15.0 * u + 6.0 * u**2), u)
    opti.set_initial(v, 30.0 * t**2 * (1.0 - t) ** 2 * length / slow)
    opti.set_initial(a, 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) * length / slow**2)
    opti.set_initial(h, np.diff(t) * slow)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes", "max_iter": 500, "tol": 1e-6})
    return float(opti.solve().value(casadi.sum1(h)))


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("robot_id", "kind", "seed", "count"),
    [
        ("three_dof_arm", "linear", 3, 100),
        ("three_dof_arm", "linear", 5, 100),
        ("date_sorting_arm", "blend", 2, 200),
        ("three_dof_arm", "through", 3, 200),
    ],
)
def test_a_curve_is_as_fast_as_an_independent_optimum(robot_id: str, kind: str, seed: int, count: int) -> None:
    path, group = random_group(robot_id, kind, seed)
    optimum = fine_optimum(path, group, count)
    duration = time_group(path, group).lengths.sum()
    assert 0.99 * optimum <= duration <= 1.01 * optimum


@pytest.mark.parametrize(("seed", "known"), [(1, 1.6136), (5, 1.6301)])
def test_blended_lines_are_as_fast_as_on_a_grid_of_more_pieces(seed: int, known: float) -> None:
    """They took 1.7 and 1.9 % more than the known duration, s, when the first grid was too coarse."""
    moves = np.random.default_rng(seed).uniform(0.04, 0.08, (5, 3)) * [[-1.0], [1.0], [-1.0], [1.0], [-1.0]]
    lines: list[AnyWaypoint] = [
        RelativeWaypoint(CartesianMove((x, y, z)), "base", motion=LinearMotion(), transition=BlendTransition(0.015))
        for x, y, z in moves.tolist()
    ]
    lines[-1] = replace(lines[-1], transition=StopTransition())
    home = JointWaypoint(position=(0.0, -1.5, 1.5, 0.0, 0.8, 0.0))
    path, group = first_group(load_robot("kuka_kr16_l6_2"), [home, *lines])
    assert time_group(path, group).lengths.sum() <= known


@pytest.mark.parametrize("kind", ["linear", "blend", "through"])
def test_tool_speed_shapes_the_law(kind: str) -> None:
    # Stretched as a whole until the tool is slow enough, the time scaling would be far slower.
    limits = Limits(tcp_linear_velocity=0.25)
    path, group = random_group("kuka_kr16_l6_2", kind, 11, limits)
    pieces = time_group(path, group)
    q, dq, _, _ = (value.reshape(-1, path.robot.dof) for value in sampled(pieces))
    speeds = tool_speeds(path.robot, q, dq)[0]
    assert speeds.max() <= 0.25 * (1.0 + 1e-9)
    free_path, free_group = random_group("kuka_kr16_l6_2", kind, 11)
    free = time_group(free_path, free_group)
    q, dq, _, _ = (value.reshape(-1, path.robot.dof) for value in sampled(free))
    factor = tool_speeds(path.robot, q, dq)[0].max() / 0.25
    assert factor > 1.2
    assert free.lengths.sum() <= pieces.lengths.sum() <= 0.9 * factor * free.lengths.sum()


def test_torque_shapes_the_law() -> None:
    robot = load_robot(TORQUE_ARM)
    path, group = random_group(TORQUE_ARM, "through", 5)
    free = time_group(path, group)
    q, dq, ddq, _ = (value.reshape(-1, robot.dof) for value in sampled(free))
    most = np.abs(inverse_dynamics(path.robot, q, dq, ddq)).max(axis=0)
    still = np.abs(inverse_dynamics(path.robot, q, 0.0 * q, 0.0 * q)).max(axis=0)
    limits = Limits(torque=tuple((still + 0.4 * (most - still) + 1e-3).tolist()))
    path, group = random_group(TORQUE_ARM, "through", 5, limits)
    pieces = time_group(path, group)
    assert_rest_to_rest(path, group, pieces)
    q, dq, ddq, _ = (value.reshape(-1, robot.dof) for value in sampled(pieces))
    assert (np.abs(inverse_dynamics(path.robot, q, dq, ddq)) <= path.limits.torque.narrower[0] * (1.0 + 1e-9)).all()
    # The whole time scaling is stretched until the torques fit: gravity + inertial / factor^2.
    assert free.lengths.sum() < pieces.lengths.sum() < 0.95 * np.sqrt(1.0 / 0.4) * free.lengths.sum()


def test_gravity_beyond_a_torque_limit_is_refused() -> None:
    robot = load_robot(TORQUE_ARM)
    path, group = random_group(TORQUE_ARM, "through", 5, Limits(torque=(1e-3,) * robot.dof))
    with pytest.raises(LimitsUnsatisfiable, match="gravity alone"):
        time_group(path, group)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["straight", "linear", "circular"])
def test_an_asked_duration_is_kept_exactly_and_refused_below_the_shortest(kind: str) -> None:
    path, group = random_group("kuka_kr16_l6_2", kind, 8)
    shortest = float(time_group(path, group).lengths.sum())
    longer = time_group(replace(path, durations=np.array([1.7 * shortest])), group)
    assert longer.lengths.sum() == pytest.approx(1.7 * shortest, rel=1e-12)
    assert_rest_to_rest(path, group, longer)
    with pytest.raises(InfeasibleDuration) as refused:
        time_group(replace(path, durations=np.array([0.99 * shortest])), group)
    (remedy,) = refused.value.remedies
    assert remedy.field == ("waypoints", 1, "duration")
    assert time_group(replace(path, durations=np.array([remedy.value])), group).lengths.sum() == pytest.approx(shortest)


def test_an_asked_duration_inside_a_run_is_refused_with_its_pointer() -> None:
    path, group = random_group("kuka_kr16_l6_2", "through", 8)
    durations = path.durations.copy()
    durations[1] = 100.0
    with pytest.raises(InvalidProblem) as refused:
        time_group(replace(path, durations=durations), group)
    assert [field for field, _ in refused.value.faults] == [("waypoints", 2, "duration")]


def test_without_any_limit_only_an_asked_duration_will_do() -> None:
    path, group = random_group("three_dof_arm", "straight", 1)
    limits = path.limits
    path = replace(path, limits=limits.without(["velocity", "acceleration", "jerk", "torque"]))
    with pytest.raises(LimitsUnsatisfiable, match="neither a duration nor"):
        time_group(path, group)
    assert time_group(replace(path, durations=np.array([3.0])), group).lengths.sum() == pytest.approx(3.0)


def test_limits_of_each_segment_count_there_and_nowhere_else() -> None:
    robot = load_robot("kuka_kr16_l6_2")
    waypoints = random_waypoints(robot, np.random.default_rng(4), "through")
    free_path, free_group = first_group(robot, waypoints)
    waypoints[1] = replace(waypoints[1], limits=Limits(velocity_scale=0.2, acceleration_scale=0.2))
    path, group = first_group(robot, waypoints)
    pieces, free = time_group(path, group), time_group(free_path, free_group)
    assert_rest_to_rest(path, group, pieces)
    slow, fast = pieces.lengths[pieces.segments == 0].sum(), pieces.lengths[pieces.segments > 0].sum()
    assert slow > 2.0 * free.lengths[free.segments == 0].sum()
    assert fast < 1.5 * free.lengths[free.segments > 0].sum()


def test_two_blends_that_meet_leave_a_piece_between_them() -> None:
    """Its length was zero once, which admits no time scaling."""
    path, group = random_group("date_sorting_arm", "blend", 0)
    assert group.curve.lengths.min() > 1e-4 * group.curve.lengths.max()
    assert_rest_to_rest(path, group, time_group(path, group))


def test_a_time_scaling_that_is_slow_everywhere_keeps_its_limits() -> None:
    """A requested duration may be far from all limits: without a near limit, the search for the largest pace failed."""
    far, none = np.full((3, 6), 0.1), np.zeros((3, 6))
    limits = LinearLimits(far, none, none, none, none + 1.0, none)
    assert near_limits(limits).scale(np.ones((3, 6))) == pytest.approx(10.0)
    one = replace(limits, by_b=np.array([0.1, 0.9, 0.1])[:, None] * np.ones(6))
    assert near_limits(one).by_b == pytest.approx(0.9 * np.ones((1, 6)))
