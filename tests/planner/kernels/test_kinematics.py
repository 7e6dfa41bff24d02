"""Poses, Jacobians and rates of arms by the kernel against a product of matrices, Pinocchio and finite differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from planner.kernels.kinematics import Arm, tip_jacobians, tip_poses, tip_rates
from planner.spatial import FloatArray
from tests.planner.kernels.arms import arm_of, random_states, robots

STEP = 1e-4
"""Step of the finite differences, s."""


def by_matrices(arm: Arm, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Multiply the 4 x 4 matrices of frames and joints; return the point's position and the tip's rotation."""
    placement = np.eye(4)
    for frame, q in zip(arm.frames, [*position.tolist(), 0.0], strict=True):
        fixed, moved = np.eye(4), np.eye(4)
        fixed[:3, :3], fixed[:3, 3] = frame[:9].reshape(3, 3), frame[9:12]
        if frame[12]:
            moved[:2, :2] = [[np.cos(q), -np.sin(q)], [np.sin(q), np.cos(q)]]
        else:
            moved[2, 3] = q
        placement = placement @ fixed @ moved
    return (placement @ [*arm.point, 1.0])[:3], placement[:3, :3]


@pytest.mark.parametrize("name", robots())
@pytest.mark.parametrize("count", [1, 3, 4, 21])
def test_poses_are_products_of_matrices(name: str, count: int) -> None:
    arm, (q, _, _) = arm_of(robots()[name]), random_states(robots()[name], count)
    points, rotations = tip_poses(arm, q)
    expected = [by_matrices(arm, row) for row in q]
    assert points == pytest.approx(np.array([point for point, _ in expected]), abs=1e-13)
    assert rotations == pytest.approx(np.array([rotation for _, rotation in expected]), abs=1e-13)


@pytest.mark.parametrize("name", robots())
def test_jacobians_and_rates_are_those_of_pinocchio(name: str) -> None:
    robot = robots()[name]
    model, data, frame, axes = robot.model, robot.data, robot.tool_frame_id, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    arm, (q, v, a) = arm_of(robot), random_states(robot, 11)
    points, _, jacobians = tip_jacobians(arm, q)
    velocities, accelerations = (np.hstack(tip_rates(arm, q, *motion)) for motion in ((v,), (v, a)))
    for k, state in enumerate(zip(q, v, a, strict=True)):
        pin.forwardKinematics(model, data, *state)
        placement = pin.updateFramePlacement(model, data, frame)
        assert points[k] == pytest.approx(placement.translation, abs=1e-12)
        assert velocities[k] == pytest.approx(pin.getFrameVelocity(model, data, frame, axes).vector, abs=1e-11)
        expected = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector
        assert accelerations[k] == pytest.approx(expected, abs=1e-10)
        assert jacobians[k] == pytest.approx(pin.computeFrameJacobian(model, data, q[k], frame, axes), abs=1e-12)


@pytest.mark.parametrize("name", robots())
def test_jerks_are_differences_of_accelerations(name: str) -> None:
    robot = robots()[name]
    arm, (q, v, a) = arm_of(robot), random_states(robot, 8, size=1.0)
    j = np.random.default_rng(1).uniform(-1.0, 1.0, q.shape)

    def accelerations(t: float) -> FloatArray:
        at = q + t * v + t**2 / 2.0 * a + t**3 / 6.0 * j
        return np.hstack(tip_rates(arm, at, v + t * a + t**2 / 2.0 * j, a + t * j))

    expected = (accelerations(STEP) - accelerations(-STEP)) / (2.0 * STEP)
    assert np.hstack(tip_rates(arm, q, v, a, j)) == pytest.approx(expected, abs=1e-5)


def test_each_state_has_the_same_bytes_alone_and_among_others() -> None:
    robot = robots()["on a rail"]
    arm, (q, v, a) = arm_of(robot), random_states(robot, 37)
    for compute in (lambda rows: tip_jacobians(arm, q[rows]), lambda rows: tip_rates(arm, q[rows], v[rows], a[rows])):
        together, alone = compute(np.arange(37)), [compute(np.array([row])) for row in range(37)]
        for values, single in zip(together, zip(*alone, strict=True), strict=True):
            assert values.tobytes() == np.concatenate(single).tobytes()


def test_no_states_and_wrong_shapes() -> None:
    arm = arm_of(robots()["kuka"])
    assert tip_poses(arm, np.empty((0, 6)))[1].shape == (0, 3, 3)
    with pytest.raises(ValueError, match="shape"):
        tip_jacobians(arm, np.zeros((4, 7)))
    with pytest.raises(ValueError, match="shape"):
        tip_rates(arm, np.zeros((4, 6)), np.zeros((3, 6)))
