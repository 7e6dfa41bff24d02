"""A robot in MuJoCo: the same chain and inertias, moved by MuJoCo's own equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from planner.robots import Robot
from planner.robots.derived.standing import foot_in_standing_link, placement_in_world
from planner.scene.bodies import JointTree
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
        spec.option.gravity = foot_in_standing_link(robot).rotation.T @ robot.chain.load[:3]
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        tree = JointTree.of(robot)
        drives = [
            {"armature": joint.rotor_inertia, "damping": joint.damping, "frictionloss": joint.friction}
            for joint in robot.joints
        ]
        add_joints(spec, tree, drives)
        self.model: Any = spec.compile()
        self.data: Any = mujoco.MjData(self.model)
        self._order = joint_numbers(self.model, robot.dof)
        self.carry(robot)

    def carry(self, robot: Robot) -> None:
        """Take over the inertias, tool and process force of the robot, as it is from here on."""
        for number, inertia in enumerate(robot.model.inertias.tolist()):
            joint, placement = placement_in_world(robot, number, pin.SE3.Identity())
            if joint == 0:  # it stands still
                continue
            body, inertia = self._body_of(joint), placement.act(inertia)
            moments, axes = np.linalg.eigh(inertia.inertia)
            axes = axes * np.sign(np.linalg.det(axes))
            self.model.body_mass[body] = self.mass_factor * inertia.mass
            self.model.body_ipos[body] = inertia.lever
            self.model.body_iquat[body] = mujoco_quaternion(axes)
            self.model.body_inertia[body] = self.mass_factor * moments
        mujoco.mj_setConst(self.model, mujoco.MjData(self.model))  # it moves the arm of the data to zero
        tool = robot.model.frames[robot.tool_frame_id]
        self._tool = placement_in_world(robot, int(tool.parentJoint), tool.placement)
        self._base, self._force = placement_in_world(robot, 0, pin.SE3.Identity()), robot.process_force

    def _body_of(self, joint: int) -> int:
        """Return MuJoCo's number of the body that a joint of the tree carries; 0 is the world."""
        return int(self.model.body(str(joint)).id) if joint else 0

    @property
    def position(self) -> FloatArray:
        """The positions (joints,), rad or m."""
        return np.array(self.data.qpos[self._order])

    @property
    def velocity(self) -> FloatArray:
        """The velocities (joints,), rad/s or m/s."""
        return np.array(self.data.qvel[self._order])

    def set_state(self, position: FloatArray, velocity: FloatArray) -> None:
        """Put the robot into a state (joints,), rad or m, and rad/s or m/s."""
        self.data.qpos[self._order], self.data.qvel[self._order] = position, velocity
        mujoco.mj_forward(self.model, self.data)

    def move(self, torques: FloatArray, steps: int) -> None:
        """Hold torques (joints,), N m or N, for a number of steps."""
        for _ in range(steps):
            self.apply(torques)
            mujoco.mj_step(self.model, self.data)

    def apply(self, torques: FloatArray) -> None:
        """Set the torques (joints,), N m or N, and with them the forces between workpiece and tool."""
        self.data.qfrc_applied[self._order] = torques
        if self._force is None:
            return
        (tool, at), (workpiece, base) = ((self._body_of(joint), own) for joint, own in (self._tool, self._base))
        turned, under = (self.data.xmat[body].reshape(3, 3) for body in (tool, workpiece))
        point = self.data.xpos[tool] + turned @ at.translation
        axes = turned @ at.rotation if self._force.frame == "tool" else under @ base.rotation
        force, moment = (axes @ np.array(vector) for vector in (self._force.force, self._force.moment))
        for body, sign in ((tool, -1.0), (workpiece, 1.0)):
            mujoco.mj_applyFT(self.model, self.data, sign * force, sign * moment, point, body, self.data.qfrc_applied)

    def acceleration(self) -> FloatArray:
        """Return the accelerations (joints,) in the state and with the torques that were set, rad/s^2 or m/s^2."""
        mujoco.mj_forward(self.model, self.data)
        return np.array(self.data.qacc[self._order])

    def mass_matrix(self) -> FloatArray:
        """Return the mass matrix (joints, joints) in the state of the last step, without the error of the masses."""
        matrix = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, matrix)
        found: FloatArray = matrix[np.ix_(self._order, self._order)] / self.mass_factor
        return found


def add_joints(spec: Any, tree: JointTree, drives: Sequence[Mapping[str, float]] = ()) -> list[Any]:
    """Add the joints of a tree, each with a body of mass 1, both named by its number from 1.

    Args:
        spec: What MuJoCo compiles.
        tree: The joints.
        drives: Further fields of each joint.

    Returns:
        The bodies, the world first.
    """
    bodies: list[Any] = [spec.worldbody] * (1 + len(tree.parents))
    for k in tree.order:
        pose = {"pos": tree.shifts[k], "quat": mujoco_quaternion(tree.turns[k])}
        # Inertias are written into the compiled model: the compiler refuses some that many published arms have.
        body = bodies[tree.parents[k]].add_body(
            name=str(k + 1), mass=1.0, inertia=np.ones(3), explicitinertial=True, **pose
        )
        kind = mujoco.mjtJoint.mjJNT_HINGE if tree.is_angle[k] else mujoco.mjtJoint.mjJNT_SLIDE
        body.add_joint(name=str(k + 1), type=kind, axis=[0.0, 0.0, 1.0], **(drives[k] if drives else {}))
        bodies[k + 1] = body
    return bodies


def joint_numbers(model: Any, joints: int) -> np.ndarray:
    """Return MuJoCo's numbers (joints,) of the joints that `add_joints` adds."""
    return np.array([model.joint(str(k + 1)).qposadr[0] for k in range(joints)], dtype=int)


def mujoco_quaternion(rotation: FloatArray) -> FloatArray:
    """Return the quaternion (w, x, y, z) of a rotation (3, 3), in MuJoCo's order."""
    x, y, z, w = pin.Quaternion(rotation).coeffs()
    return np.array([w, x, y, z])
