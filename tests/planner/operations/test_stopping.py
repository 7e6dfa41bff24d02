"""The fastest stop of each joint, against Ruckig's velocity interface and linear programs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from planner.errors import InvalidProblem, JointPositionLimit, LimitsUnsatisfiable, PayloadExceeded
from planner.limits import Limits
from planner.operations import JointState, slice_trajectory, stop_joints, stop_on_path
from planner.robots import load_robot
from planner.robots.payload import Payload
from tests.planner.operations.curves import by_scipy, fastest_by_ruckig, inner_times, kuka, planned

STILL = np.zeros(6)
MIDDLE = (kuka().limit("lower") + kuka().limit("upper")) / 2.0


def is_possible(state: tuple[float, float, float], duration: float, limits: list[float], upper: float) -> bool:
    """Tell whether a stop below an upper limit takes no longer, by a linear program of piecewise constant jerks."""
    count, (q, v, a) = 120, state
    h, steps = duration / 120, np.arange(121)
    rows = np.zeros((3, count + 1, count))
    for k in range(count):
        rows[:, k + 1] = rows[:, k]
        rows[0, k + 1] += h * rows[1, k] + h * h / 2.0 * rows[2, k]
        rows[1, k + 1] += h * rows[2, k]
        rows[:, k + 1, k] += [h**3 / 6.0, h * h / 2.0, h]
    free = [q + v * h * steps + a * (h * steps) ** 2 / 2.0, v + a * h * steps, np.full(count + 1, a)]
    velocity, acceleration, jerk = limits
    upper_rows = [rows[0], rows[1], -rows[1], rows[2], -rows[2]]
    bounds = [upper - free[0], velocity - free[1], velocity + free[1], acceleration - free[2], acceleration + free[2]]
    at_end = [-free[1][-1], -free[2][-1]]
    ends = np.array([rows[1, -1], rows[2, -1]])
    most = np.concatenate(bounds) + 1e-9
    program = linprog(np.zeros(count), np.vstack(upper_rows), most, ends, at_end, bounds=(-jerk, jerk))
    return bool(program.status == 0)


@pytest.mark.large_only
def test_each_joint_stops_as_fast_as_ruckig_stops_it() -> None:
    robot, random = kuka(), np.random.default_rng(7)
    velocity, acceleration = robot.limit("velocity"), robot.limit("acceleration")
    stopped = 0
    for number in range(60):
        q = MIDDLE + random.uniform(-0.2, 0.2, 6) * (robot.limit("upper") - robot.limit("lower"))
        v, a = random.uniform(-0.9, 0.9, (2, 6)) * [velocity, acceleration]
        a *= number % 3 > 0
        v[number % 6] *= number % 5 > 0
        state = JointState(q, v, a)
        expected = fastest_by_ruckig(robot, state)
        try:
            stop = stop_joints(robot, state)
        except JointPositionLimit:
            continue
        stopped += 1
        assert stop.certificate.continuity in ("C2", "C3", "C4")
        for values, found in zip((q, v, a), vars(stop.initial).values(), strict=True):
            assert found == pytest.approx(values, abs=1e-9)
        assert stop.final.velocity == pytest.approx(STILL, abs=1e-9)
        within = stop.trajectory.evaluate(stop.trajectory.sample_times(0.002), [0])[0]
        if (np.minimum(robot.limit("upper") - within, within - robot.limit("lower")) > 1e-6).all():
            assert stop.trajectory.duration == pytest.approx(max(expected), rel=1e-9)
        else:
            assert stop.trajectory.duration >= max(expected) * (1 - 1e-9)
    assert stopped > 30


@pytest.mark.parametrize(("distance", "comes_back"), [(0.45, False), (0.3949, False), (0.393, True), (0.392, True)])
def test_a_joint_near_its_limit_brakes_longer_and_comes_back(distance: float, comes_back: bool) -> None:
    robot = kuka()
    position, velocity = MIDDLE.copy(), STILL.copy()
    upper = float(robot.limit("upper")[0])
    position[0], velocity[0] = upper - distance, 2.0
    stop = stop_joints(robot, JointState(position, velocity, STILL)).trajectory
    at, speed = stop.evaluate(stop.sample_times(0.001), [0, 1])
    assert at[:, 0].max() <= upper + 1e-8
    assert (speed[:, 0].min() < -1e-3) == comes_back
    limits = [float(robot.limit(quantity)[0]) for quantity in ("velocity", "acceleration", "jerk")]
    state = float(position[0]), 2.0, 0.0
    assert is_possible(state, 1.02 * stop.duration, limits, upper)
    assert not is_possible(state, 0.98 * stop.duration, limits, upper)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_too_fast_towards_a_limit_says_which_and_how_far(side: float) -> None:
    robot = kuka()
    position, velocity = MIDDLE.copy(), STILL.copy()
    bound = robot.limit("upper" if side > 0.0 else "lower")
    position[0], velocity[0] = bound[0] - side * 0.39, side * 2.0
    with pytest.raises(JointPositionLimit, match=r"joint_a1 moves at .*2 towards its limit and cannot stop") as refused:
        stop_joints(robot, JointState(position, velocity, STILL))
    limits = [float(robot.limit(quantity)[0]) for quantity in ("velocity", "acceleration", "jerk")]
    assert refused.value.limit == pytest.approx(bound[0])
    value = side * (refused.value.value or 0.0)
    state = side * position[0], 2.0, 0.0
    assert is_possible(state, 1.2, limits, value + 1e-4)
    assert not is_possible(state, 1.2, limits, value - 1e-3)


def test_torque_and_tool_speed_are_kept_by_braking_more_gently() -> None:
    robot = kuka()
    state = JointState(*planned("toppra").evaluate(0.3))
    state = replace(state, acceleration=STILL)
    free = stop_joints(robot, state)
    [torque] = [check for check in free.certificate.checks if check.quantity == "torque"]
    share = 0.8 * (torque.ratio or 0.0)
    limits = Limits(torque=tuple(share * robot.limit("torque")))
    gentle = stop_joints(robot, state, limits=limits)
    [torque] = [check for check in gentle.certificate.checks if check.quantity == "torque"]
    assert 0.9 < (torque.ratio or 0.0) <= 1.0 + 1e-9
    assert gentle.trajectory.duration > free.trajectory.duration
    with pytest.raises(LimitsUnsatisfiable, match="torque"):
        stop_joints(robot, state, limits=Limits(torque=tuple(0.01 * robot.limit("torque"))))


def test_without_a_jerk_limit_accelerations_jump() -> None:
    robot = replace(kuka(), joints=tuple(replace(joint, jerk=np.inf) for joint in kuka().joints))
    state = JointState(MIDDLE, np.array([1.0, -0.5, 0.0, 1e-9, 2.0, 0.0]), STILL)
    stop = stop_joints(robot, state)
    assert stop.trajectory.duration == pytest.approx((np.abs(state.velocity) / robot.limit("acceleration")).max())
    assert stop.certificate.continuity == "C1"
    not_kept = stop_joints(kuka(), state, enforced=("position", "velocity", "acceleration", "torque"))
    assert not_kept.trajectory.duration == stop.trajectory.duration
    near = replace(state, position=MIDDLE.copy())
    near.position[0] = robot.limit("upper")[0] - 0.5 * 1.0 / robot.limit("acceleration")[0] - 1e-6
    assert stop_joints(robot, near).certificate.satisfied


def test_what_rests_keeps_resting_and_what_hardly_moves_stops() -> None:
    assert stop_joints(kuka(), JointState(MIDDLE, STILL, STILL)).trajectory.duration == 0.01
    crawling = np.array([1e-12, 0.0, -1e-9, 0.0, 0.0, 1e-15])
    assert stop_joints(kuka(), JointState(MIDDLE, crawling, STILL)).final.velocity == pytest.approx(STILL, abs=1e-15)
    turning = stop_joints(kuka(), JointState(MIDDLE, STILL, 0.5 * kuka().limit("acceleration")))
    times = inner_times(turning.trajectory)
    assert (np.abs(by_scipy(turning.trajectory, times, 3)) <= kuka().limit("jerk") * (1 + 1e-9)).all()


def test_joints_that_reach_their_peaks_almost_at_once_stop_without_a_jump() -> None:
    """All joints of a straight motion brake; their phases end within nanoseconds of each other."""
    position = [0.2139364, 0.53775349, -1.2363321, -1.43407263, -0.95578211, 1.60327615, -1.3458316]
    velocity = [-2.60568002, 2.21753762, 2.61376327, -0.61349094, 0.96737155, -0.76846345, -2.14125484]
    acceleration = np.array([-4.18695682, 3.56326684, 4.19994512, -0.985792833, 1.55442804, -1.23481121, -3.44069195])
    for scale in (1e-4, 1e-6, 1e-8, 0.0):
        state = JointState(np.array(position), np.array(velocity), scale * acceleration)
        stop = stop_joints(load_robot("fr3"), state)
        assert stop.certificate.continuity == "C2"
        (end,) = stop.trajectory.evaluate(stop.trajectory.duration, [1])
        assert np.abs(end).max() <= 1e-9


def test_states_that_are_refused() -> None:
    fast, beyond = 1.01 * kuka().limit("velocity"), kuka().limit("upper") + 1e-3
    with pytest.raises(LimitsUnsatisfiable, match=r"the velocity of joint_a1 is .* when the stop begins"):
        stop_joints(kuka(), JointState(MIDDLE, fast, STILL))
    with pytest.raises(LimitsUnsatisfiable, match="the acceleration of joint_a1"):
        stop_joints(kuka(), JointState(MIDDLE, STILL, 2.0 * kuka().limit("acceleration")))
    with pytest.raises(JointPositionLimit, match="when the stop begins"):
        stop_joints(kuka(), JointState(beyond, STILL, STILL))
    with pytest.raises(InvalidProblem, match="2 values for 6 joints"):
        stop_joints(kuka(), JointState(MIDDLE, np.zeros(2), STILL))
    with pytest.raises(InvalidProblem, match="numbers"):
        stop_joints(kuka(), JointState(MIDDLE, STILL * np.nan, STILL))


@pytest.mark.parametrize("on_path", [False, True])
@pytest.mark.parametrize("mass", [16.0, 17.0, 50.0])
def test_a_payload_above_the_rating_never_keeps_a_robot_from_stopping(on_path: bool, mass: float) -> None:
    """A robot without a rating shows the reference stop; the rating of 16 kg adds a warning."""
    given, warned = planned("quintic"), ["payload_above_rating"] if mass > 16.0 else []
    time, stops = 0.3 * given.duration, []
    for robot in (kuka(), replace(kuka(), rated_payload=None)):
        loaded = robot.with_payload(Payload(mass))
        state = JointState(*given.evaluate(time))
        stops.append(stop_on_path(loaded, given, time) if on_path else stop_joints(loaded, state))
    stop, unrated = stops
    assert stop.certificate.satisfied
    assert np.array_equal(stop.trajectory.coefficients, unrated.trajectory.coefficients)
    assert [warning.code for warning in stop.warnings if warning not in unrated.warnings] == warned
    for warning in stop.warnings:
        if warning.code in warned:
            assert f"{mass:g} kg exceeds the rated 16 kg" in warning.message


def test_every_other_operation_refuses_a_payload_above_the_rating() -> None:
    with pytest.raises(PayloadExceeded, match="exceeds the rated"):
        slice_trajectory(kuka().with_payload(Payload(17.0)), planned("quintic"), 0.1)
