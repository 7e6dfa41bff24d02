"""Bounds on torques and on the tool's motion against Pinocchio: no sample exceeds them, and each is almost reached."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from planner.certificate.tool_path import PATH_DEVIATIONS
from planner.constraints import POWER, TOOL, TORQUE, TOTAL_POWER, Bounds
from planner.constraints.bounded import BOUND_KNOWN_TO, KIND_OF, bounded_peaks
from planner.constraints.peaks import SampledConstraints
from planner.dynamics import SegmentDynamics
from planner.errors import InvalidProblem
from planner.kernels.bounded_peaks import KINDS, BoundedPeaks
from planner.kinematics.forward import TIGHTEST_BEND, JointStates
from planner.robots import Robot
from planner.spatial import Pose
from planner.trajectories.extrema import UnitPolynomials, derivatives_on_unit_time
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.kernels.arms import quintics, robots

OF_ROBOTS = ("torque_at_speed", "torque_with_tolerances", "acceleration_at_speed", "jerk_at_speed")
NAMES = tuple(name for name in KINDS if name not in (*OF_ROBOTS, *PATH_DEVIATIONS))
"""The constraints of robots without limits by speed and tolerances."""

ROUNDING_OF_SAMPLES = 1e-11
"""Relative amount by which rounding alone may put a sample above a peak."""


def values(robot: Robot, states: np.ndarray) -> dict[str, np.ndarray]:
    """Compute the quantities (N, columns) at states (4, N, joints) by Pinocchio; the kinematics give jerks."""
    model, data = robot.model, robot.data
    found: dict[str, list[object]] = {name: [] for name in NAMES}
    for q, v, a, _ in states.transpose(1, 0, 2):
        torque = pin.rnea(model, data, q, v, a)
        found["torque"].append(torque.copy())
        found["power"].append(torque * v)
        found["total_power"].append([torque @ v])
        pin.forwardKinematics(model, data, q, v, a)
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        speed = pin.getFrameVelocity(model, data, robot.tool_frame_id, axes)
        gain = pin.getFrameClassicalAcceleration(model, data, robot.tool_frame_id, axes)
        fast = float(np.linalg.norm(speed.linear))
        across = float(np.linalg.norm(np.cross(speed.linear, gain.linear))) / max(fast, 1e-300)
        found["tcp_linear_velocity"].append([fast])
        found["tcp_angular_velocity"].append([np.linalg.norm(speed.angular)])
        found["tcp_linear_acceleration"].append([np.linalg.norm(gain.linear)])
        found["tcp_angular_acceleration"].append([np.linalg.norm(gain.angular)])
        found["tcp_centripetal_acceleration"].append([min(across, fast * fast / TIGHTEST_BEND)])
    at = JointStates(robot, *states)
    for name in ("tcp_linear_jerk", "tcp_angular_jerk"):
        found[name] = list(at.tool_rate(name)[:, None])
    return {name: np.array(rows, dtype=float) for name, rows in found.items()}


def columns(robot: Robot, name: str) -> int:
    """Return the number of values of a quantity."""
    return robot.dof if name in ("torque", "power") else 1


def limited(robot: Robot, limits: dict[str, np.ndarray]) -> SampledConstraints:
    """Return all constraints, with a limit for each value."""
    every = (TORQUE, POWER, TOTAL_POWER, *TOOL.values())
    own = [(constraint, Bounds.of_magnitudes(limits[constraint.name][None])) for constraint in every]
    return SampledConstraints(SegmentDynamics.unchanged(robot), own, 1)


def unit(motion: PiecewisePolynomial) -> UnitPolynomials:
    return derivatives_on_unit_time(motion, 6)


def test_the_kinds_are_the_constraints() -> None:
    named = {constraint.name: KINDS[kind] for constraint, kind in KIND_OF.items()}
    assert named == {name: name for name in (*NAMES, *OF_ROBOTS)}


@pytest.mark.long_table
@pytest.mark.parametrize("name", robots())
@pytest.mark.parametrize(("way", "seconds"), [(1.0, 0.8), (3.0, 3.0), (0.01, 0.05)])
def test_no_sample_exceeds_a_bound_and_each_bound_is_reached(name: str, way: float, seconds: float) -> None:
    robot = robots()[name].with_tool(Pose.from_rpy([0.05, 0.02, 0.2], [0.0, 0.6, 0.0]))
    motion = quintics(robot, 3, way=way, seconds=seconds)
    count = len(motion.lengths)
    pieces, units = np.repeat(np.arange(count), 400), np.tile(np.linspace(0.0, 1.0, 400), count)
    derivatives = unit(motion)
    dense = values(robot, derivatives[:4].evaluate(pieces, units))
    limits = {quantity: np.full(found.shape[1], found.max() or 1.0) for quantity, found in dense.items()}
    constraints = limited(robot, limits)
    peaks = bounded_peaks(constraints, np.zeros(count, dtype=int), derivatives, motion.lengths)
    for k, constraint in enumerate(constraints.constraints):
        use = np.abs(dense[constraint.name]) / limits[constraint.name]
        assert use.max() <= peaks.bound[k] * (1.0 + ROUNDING_OF_SAMPLES), constraint.name
        assert peaks.bound[k] <= peaks.reached[k] * (1.0 + 1.01 * BOUND_KNOWN_TO), constraint.name
        there = values(robot, derivatives[:4].evaluate(peaks.pieces[[k]], peaks.units[[k]]))[constraint.name][0]
        column = peaks.columns[k] - int(np.searchsorted(constraints.of_column, k))
        reached = abs(there[column]) / limits[constraint.name][column]
        assert peaks.reached[k] * (1.0 - ROUNDING_OF_SAMPLES) <= reached, constraint.name


@pytest.mark.long_table
@pytest.mark.parametrize("name", NAMES)
def test_whether_a_limit_is_kept_is_decided_to_a_billionth(name: str) -> None:
    robot = robots()["loaded"]
    motion, none = (
        quintics(robot, 5),
        {name: np.full(columns(robot, name), np.inf) for name in NAMES},
    )
    derivatives, segments = unit(motion), np.zeros(len(motion.lengths), dtype=int)

    def peaks(limit: float) -> BoundedPeaks:
        constraints = limited(robot, none | {name: np.full_like(none[name], limit)})
        found = bounded_peaks(constraints, segments, derivatives, motion.lengths)
        k = [constraint.name for constraint in constraints.constraints].index(name)
        return BoundedPeaks(*(part[[k]] for part in found))

    about = peaks(1.0)
    units = np.clip(about.units + np.linspace(-4e-3, 4e-3, 4001), 0.0, 1.0)
    pieces = np.repeat(about.pieces, len(units))
    peak = np.abs(values(robot, derivatives[:4].evaluate(pieces, units))[name]).max()
    assert about.reached[0] <= peak <= about.bound[0]
    assert peaks(peak * (1.0 - 5e-10)).bound[0] <= 1.0 + 1e-9
    assert peaks(peak * (1.0 - 2e-9)).reached[0] > 1.0 + 1e-9


@pytest.mark.large_only
def test_unequal_limits_of_torque_count_from_their_middle() -> None:
    robot = robots()["loaded"]
    motion = quintics(robot, 8)
    lower, upper = -np.linspace(30.0, 90.0, robot.dof), np.linspace(200.0, 20.0, robot.dof)
    own = [(TORQUE, Bounds(lower[None], upper[None]))]
    constraints = SampledConstraints(SegmentDynamics.unchanged(robot), own, 1)
    derivatives, count = unit(motion), len(motion.lengths)
    pieces, units = np.repeat(np.arange(count), 2000), np.tile(np.linspace(0.0, 1.0, 2000), count)
    torque = values(robot, derivatives[:4].evaluate(pieces, units))["torque"]
    worst = (np.abs(torque - (upper + lower) / 2.0) / ((upper - lower) / 2.0)).max()
    (bound,) = bounded_peaks(constraints, np.zeros(count, dtype=int), derivatives, motion.lengths).bound
    assert worst * (1.0 - ROUNDING_OF_SAMPLES) <= bound <= worst * (1.0 + 1e-5)


@pytest.mark.long_table
@pytest.mark.parametrize("of_pieces", [[0, 0, 1, 1, 1, 1], [0, 0, 0, 0, 0, 1]])
@pytest.mark.parametrize("names", [("kuka", "loaded"), ("loaded", "kuka")])
def test_a_payload_counts_on_its_own_segments_only(names: tuple[str, str], of_pieces: list[int]) -> None:
    arms, segments = [robots()[name] for name in names], np.array(of_pieces)
    motion = quintics(arms[0], 4, pieces=6)
    dynamics = SegmentDynamics.of_robots([*arms, arms[0]])
    own = [(TORQUE, Bounds.of_magnitudes(np.ones((2, arms[0].dof))))]
    derivatives = unit(motion)
    pieces, units = np.repeat(np.arange(6), 1000), np.tile(np.linspace(0.0, 1.0, 1000), 6)
    states = derivatives[:4].evaluate(pieces, units)
    on = [segments[pieces] == k for k in range(2)]
    worst = max(np.abs(values(arm, states[:, rows])["torque"]).max() for arm, rows in zip(arms, on, strict=True))
    found = bounded_peaks(SampledConstraints(dynamics, own, 2), segments, derivatives, motion.lengths)
    assert worst * (1.0 - ROUNDING_OF_SAMPLES) <= found.bound[0] <= worst * (1.0 + 1e-4)
    there = values(arms[segments[found.pieces[0]]], derivatives[:4].evaluate(found.pieces, found.units))
    assert found.reached[0] * (1.0 - ROUNDING_OF_SAMPLES) <= np.abs(there["torque"]).max() <= found.bound[0]


def test_a_tool_that_turns_back_has_a_bounded_bend() -> None:
    """At the turning point its velocity is zero, and its bend as tight as the least radius."""
    robot = robots()["loaded"]
    coefficients = np.zeros((1, robot.dof, 4))
    coefficients[0, :, 0] = np.linspace(-0.5, 0.7, robot.dof)
    coefficients[0, :, 1] = np.linspace(-0.6, 0.9, robot.dof) * 0.5
    coefficients[0, :, 2] = -np.linspace(-0.6, 0.9, robot.dof) * 0.5
    coefficients[0, 0, 3] = 1e-3
    motion = PiecewisePolynomial(np.ones(1), coefficients)
    derivatives = unit(motion)
    states = derivatives[:4].evaluate(np.zeros(20_001, dtype=int), np.linspace(0.0, 1.0, 20_001))
    across = JointStates(robot, *states).tool_rate("tcp_centripetal_acceleration")
    one = {name: np.ones(columns(robot, name)) for name in NAMES}
    constraints = limited(robot, one)
    found = bounded_peaks(constraints, np.zeros(1, dtype=int), derivatives, motion.lengths)
    k = [constraint.name for constraint in constraints.constraints].index("tcp_centripetal_acceleration")
    assert across.max() <= found.bound[k] <= 1.01 * max(across.max(), found.reached[k])


@pytest.mark.parametrize("degree", [0, 1, 3, 8])
def test_pieces_of_any_degree(degree: int) -> None:
    robot = robots()["slides"]
    rng = np.random.default_rng(degree)
    motion = PiecewisePolynomial(np.array([0.7, 1.3]), rng.uniform(-1.0, 1.0, (2, robot.dof, degree + 1)))
    derivatives = unit(motion)
    pieces, units = np.repeat(np.arange(2), 5000), np.tile(np.linspace(0.0, 1.0, 5000), 2)
    at = JointStates(robot, *derivatives[:4].evaluate(pieces, units))
    one = {name: np.ones(columns(robot, name)) for name in NAMES}
    constraints = limited(robot, one)
    found = bounded_peaks(constraints, np.zeros(2, dtype=int), derivatives, motion.lengths)
    for k, constraint in enumerate(constraints.constraints):
        worst = at.tool_rate(constraint.name).max() if constraint.name in TOOL else 0.0
        assert worst <= found.bound[k] * (1.0 + ROUNDING_OF_SAMPLES) + 1e-12
        assert found.bound[k] <= worst * (1.0 + 1e-4) + 1e-8


def test_a_motion_that_would_take_millions_of_intervals_is_refused() -> None:
    robot = robots()["kuka"]
    motion = quintics(robot, 1)
    far = replace(motion, coefficients=motion.coefficients * 1e8)
    one = {name: np.ones(columns(robot, name)) for name in NAMES}
    with pytest.raises(InvalidProblem, match="limits: on a motion on which a joint travels this far"):
        bounded_peaks(limited(robot, one), np.zeros(len(far.lengths), dtype=int), unit(far), far.lengths)
