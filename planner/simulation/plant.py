"""A robot in MuJoCo: the same chain and inertias, moved by MuJoCo's own equations."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from planner.robots import Robot
from planner.spatial import FloatArray


class Plant:
    """A robot that torques move."""

    def __init__(self, robot: Robot, step: float, mass_error: float) -> None:
        """Build the model.

        Args:
            robot: The robot, with tool and payload.
            step: Step of the integration, s.
            mass_error: Share by which all masses and inertias are larger than the robot's.
        """
        self.mass_factor = 1.0 + mass_error
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        spec.option.timestep = step
        spec.option.gravity = robot.model.gravity.linear
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        body = spec.worldbody
        for number, is_angle in enumerate(robot.is_angle.tolist(), 1):
            placement = robot.model.jointPlacements[number]
            # Inertias are written into the compiled model: the compiler refuses some that many published arms have.
            body = body.add_body(
                pos=placement.translation,
                quat=mujoco_quaternion(placement.rotation),
                mass=1.0,
                inertia=np.ones(3),
                explicitinertial=True,
            )
            kind = mujoco.mjtJoint.mjJNT_HINGE if is_angle else mujoco.mjtJoint.mjJNT_SLIDE
            joint = robot.joints[number - 1]
            body.add_joint(
                type=kind,
                axis=[0.0, 0.0, 1.0],
                armature=joint.rotor_inertia,
                damping=joint.damping,
                frictionloss=joint.friction,
            )
        self.model: Any = spec.compile()
        self.data: Any = mujoco.MjData(self.model)
        self.carry(robot)

    def carry(self, robot: Robot) -> None:
        """Take over the inertias, tool and process force of the robot, as it is from here on."""
        for number in range(1, robot.model.njoints):
            inertia = robot.model.inertias[number]
            moments, axes = np.linalg.eigh(inertia.inertia)
            axes = axes * np.sign(np.linalg.det(axes))
            self.model.body_mass[number] = self.mass_factor * inertia.mass
            self.model.body_ipos[number] = inertia.lever
            self.model.body_iquat[number] = mujoco_quaternion(axes)
            self.model.body_inertia[number] = self.mass_factor * moments
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))  # it moves the arm of the data to zero
        self.tool, self.force = robot.model.frames[robot.tool_frame_id], robot.process_force

    def set_state(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put the robot into a state (joints,), rad or m, and rad/s or m/s."""
        self.data.qpos[:], self.data.qvel[:] = position, velocity
        mujoco.mj_forward(self.model, self.data)

    def move(self, torques: FloatArray, steps: int) -> None:
        """Hold torques (joints,), N m or N, for a number of steps."""
        for _ in range(steps):
            self.apply(torques)
            mujoco.mj_step(self.model, self.data)

    def apply(self, torques: FloatArray) -> None:
        """Set the torques (joints,), N m or N, and with them the force that the workpiece exerts on the tool."""
        self.data.qfrc_applied[:] = torques
        if self.force is None:
            return
        body = self.tool.parentJoint
        turned = self.data.xmat[body].reshape(3, 3)
        point = self.data.xpos[body] + turned @ self.tool.placement.translation
        axes = turned @ self.tool.placement.rotation if self.force.frame == "tool" else np.eye(3)
        force, moment = (-axes @ np.array(vector) for vector in (self.force.force, self.force.moment))
        mujoco.mj_applyFT(self.model, self.data, force, moment, point, body, self.data.qfrc_applied)

    def acceleration(self) -> FloatArray:
        """Return the accelerations (joints,) in the state and with the torques that were set, rad/s^2 or m/s^2."""
        mujoco.mj_forward(self.model, self.data)
        return np.array(self.data.qacc)

    def mass_matrix(self) -> FloatArray:
        """Return the mass matrix (joints, joints) in the state of the last step, without the error of the masses."""
        matrix = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, matrix)
        return matrix / self.mass_factor


def mujoco_quaternion(rotation: FloatArray) -> FloatArray:
    """Return the quaternion (w, x, y, z) of a rotation (3, 3), in MuJoCo's order."""
    x, y, z, w = pin.Quaternion(rotation).coeffs()
    return np.array([w, x, y, z])
