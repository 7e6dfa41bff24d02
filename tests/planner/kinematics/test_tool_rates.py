"""Velocity and acceleration of the tool against Pinocchio's frame kinematics, and against differences of its poses."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from planner.kinematics import FloatArray, Pose, tool_accelerations, tool_jerks, tool_speeds, tool_velocities
from planner.robots import Robot, load_robot
from planner.spatial import rotation_from_rpy
from tests.planner.problems_of_tests import ARMS, random_position

TOOL = Pose(np.array([0.1, -0.2, 0.3]), rotation_from_rpy(0.4, -0.5, 0.6))
AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def random_states(robot: Robot, count: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Draw positions, velocities and accelerations, (count, joints) each; some joints rest."""
    rng = np.random.default_rng(seed)
    q = np.array([random_position(robot, rng) for _ in range(count)])
    v, a = rng.normal(size=(2, *q.shape)) * (rng.random((2, *q.shape)) < 0.8)
    return q, v, a


def arms() -> list[Robot]:
    plain = [load_robot(name) for name in [*ARMS, "kuka_kr16_2", "welding_arm"]]
    return [*plain, *(robot.with_tool(TOOL) for robot in plain)]


@pytest.mark.parametrize("robot", arms(), ids=lambda robot: robot.id)
def test_rates_are_pinocchios(robot: Robot) -> None:
    q, v, a = random_states(robot, 30, 1)
    data = robot.model.createData()
    (linear, angular), (dlinear, dangular) = tool_velocities(robot, q, v), tool_accelerations(robot, q, v, a)
    for i in range(len(q)):
        pin.forwardKinematics(robot.model, data, q[i], v[i], a[i])
        pin.updateFramePlacements(robot.model, data)
        velocity = pin.getFrameVelocity(robot.model, data, robot.tool_frame_id, AXES)
        acceleration = pin.getFrameClassicalAcceleration(robot.model, data, robot.tool_frame_id, AXES)
        assert linear[i] == pytest.approx(velocity.linear, abs=1e-12)
        assert angular[i] == pytest.approx(velocity.angular, abs=1e-12)
        assert dlinear[i] == pytest.approx(acceleration.linear, abs=1e-11)
        assert dangular[i] == pytest.approx(acceleration.angular, abs=1e-11)
    speeds = tool_speeds(robot, q, v)
    assert speeds[0] == pytest.approx(np.linalg.norm(linear, axis=1), abs=1e-12)
    assert speeds[1] == pytest.approx(np.linalg.norm(angular, axis=1), abs=1e-12)


@pytest.mark.parametrize("robot", arms(), ids=lambda robot: robot.id)
def test_accelerations_are_differences_of_velocities(robot: Robot) -> None:
    """The motion is q + v t + a t^2 / 2, by central differences, without gravity."""
    q, v, a = random_states(robot, 10, 2)
    h = 1e-5
    before, after = (tool_velocities(robot, q + s * v + 0.5 * s * s * a, v + s * a) for s in (-h, h))
    for found, low, high in zip(tool_accelerations(robot, q, v, a), before, after, strict=True):
        assert found == pytest.approx((high - low) / (2.0 * h), abs=1e-7)
    still = np.zeros_like(q)
    assert not np.any(tool_accelerations(robot, q, still, still))


@pytest.mark.parametrize("robot", arms(), ids=lambda robot: robot.id)
def test_jerks_are_differences_of_accelerations(robot: Robot) -> None:
    """The motion is q + v t + a t^2 / 2 + j t^3 / 6, by central differences."""
    q, v, a = random_states(robot, 10, 3)
    j = np.random.default_rng(4).normal(size=q.shape)
    h = 1e-5
    before, after = (
        tool_accelerations(robot, q + s * (v + s * (a / 2.0 + s * j / 6.0)), v + s * (a + s * j / 2.0), a + s * j)
        for s in (-h, h)
    )
    for found, low, high in zip(tool_jerks(robot, q, v, a, j), before, after, strict=True):
        assert found == pytest.approx((high - low) / (2.0 * h), abs=1e-6)
    still = np.zeros_like(q)
    assert not np.any(tool_jerks(robot, q, still, still, still))
