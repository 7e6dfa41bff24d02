"""Models of Pinocchio as robots: kinematics, torques and limits beside the model's own."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.spatial import FloatArray

KINDS = (
    pin.JointModelRX(),
    pin.JointModelRY(),
    pin.JointModelRZ(),
    pin.JointModelPX(),
    pin.JointModelPY(),
    pin.JointModelRUBY(),
    pin.JointModelRevoluteUnaligned(0.6, 0.0, 0.8),
    pin.JointModelPrismaticUnaligned(0.0, 0.6, 0.8),
)


def _chain(seed: int) -> pin.Model:
    """Return a random chain of joints of all kinds, with a tool frame at its end."""
    rng, model, parent = np.random.default_rng(seed), pin.Model(), 0
    for number, kind in enumerate(rng.permutation(len(KINDS))[:6].tolist()):
        joint = KINDS[kind]
        sides = (np.full(joint.nq, -1.5), np.full(joint.nq, 1.5))
        speed, effort = np.full(joint.nv, 1.0 + number), np.full(joint.nv, 10.0 + number)
        parent = model.addJoint(parent, joint, pin.SE3.Random(), f"j{number}", effort, speed, *sides)
        model.appendBodyToJoint(parent, pin.Inertia.Random(), pin.SE3.Random())
    model.addFrame(pin.Frame("tool", parent, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    drives = rng.uniform(0.0, 2.0, (5, model.nv))
    model.armature, model.rotorInertia, model.rotorGearRatio, model.damping, friction = drives
    model.lowerDryFrictionLimit, model.upperDryFrictionLimit = -friction, friction
    return model


def _configuration(model: pin.Model, values: FloatArray) -> FloatArray:
    """Return Pinocchio's configuration, which has cosine and sine of a continuous joint."""
    return np.concatenate(
        [
            [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
            for joint, value in zip(list(model.joints)[1:], values, strict=True)
        ]
    )


@pytest.mark.parametrize("seed", range(8))
def test_poses_and_torques_are_those_of_the_model(seed: int) -> None:
    pin.seed(seed)
    model, rng = _chain(seed), np.random.default_rng(seed)
    robot = planner.Robot.from_urdf(planner.files_of_model(model).urdf, tip_frame="tool")
    data = model.createData()
    for q, v, a in rng.uniform(-1.0, 1.0, (20, 3, 6)):
        whole = _configuration(model, q)
        pin.framesForwardKinematics(model, data, whole)
        placement, pose = data.oMf[model.getFrameId("tool")], planner.tool_pose(robot, q)
        np.testing.assert_allclose(pose.position, placement.translation, atol=1e-12)
        np.testing.assert_allclose(pose.rotation, placement.rotation, atol=1e-12)
        # Pinocchio's inverse dynamics have the armature alone.
        of_drives = model.rotorInertia * model.rotorGearRatio**2 * a + model.damping * v
        torques = pin.rnea(model, data, whole, v, a) + of_drives + model.upperDryFrictionLimit * np.sign(v)
        found = planner.inverse_dynamics(robot, q, v, a)
        np.testing.assert_allclose(found, torques, atol=1e-9 * max(1.0, np.abs(torques).max()))
    assert [joint.velocity for joint in robot.joints] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert [joint.torque for joint in robot.joints] == [10.0, 11.0, 12.0, 13.0, 14.0, 15.0]
    limited = [joint.kind != "continuous" for joint in robot.joints]
    np.testing.assert_array_equal([joint.upper for joint in robot.joints], np.where(limited, 1.5, np.inf))


def test_a_model_of_the_package_is_planned_for() -> None:
    model = pin.buildSampleModelManipulator()
    model.lowerEffortLimit, model.upperEffortLimit = np.full(6, -100.0), np.full(6, 100.0)  # its own do not hold it up
    robot = planner.Robot.from_urdf(planner.files_of_model(model).urdf, tip_frame="effector_body")
    plan = planner.plan(planner.PlanningProblem(robot, [np.zeros(6), np.full(6, 0.3)]), planner.Quintic())
    assert plan.certificate.satisfied


def test_a_free_flyer_is_refused() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    with pytest.raises(planner.InvalidRobotModel, match="root is a joint of the kind FreeFlyer"):
        planner.files_of_model(model)
