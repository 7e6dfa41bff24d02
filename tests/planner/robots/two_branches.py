"""An arm and a positioner as two models of Pinocchio that stand in the world, independent of the library's chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from planner.robots import ExternalAxis, Robot
from planner.spatial import FloatArray, Pose


def se3(pose: Pose | None) -> pin.SE3:
    return pin.SE3.Identity() if pose is None else pin.SE3(np.array(pose.rotation), np.array(pose.position))


@dataclass(frozen=True, eq=False)
class TwoBranches:
    """The arm alone and its positioner, in the frame in which both stand.

    Attributes:
        arm: The arm, with its tool and mounting.
        axes: The axes of the positioner, from the arm's base to the workpiece.
        workpiece: Pose of the workpiece in the link of the last axis.
    """

    arm: Robot
    axes: Sequence[ExternalAxis]
    workpiece: Pose

    @cached_property
    def robot(self) -> Robot:
        """The robot of the library with both."""
        return self.arm.derived(id="cell", positioner=self.axes, workpiece=self.workpiece)

    @cached_property
    def positioner(self) -> pin.Model:
        """The positioner alone."""
        model, parent = pin.Model(), 0
        for axis in self.axes:
            direction = np.array(axis.axis) / np.linalg.norm(axis.axis)
            slides = axis.kind == "prismatic"
            joint = (pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned)(direction)
            parent = model.addJoint(parent, joint, se3(axis.origin), axis.name)
            xx, xy, xz, yy, yz, zz = axis.inertia or (0.0,) * 6
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            body = pin.Inertia(axis.mass or 0.0, np.array(axis.center_of_mass), inertia)
            model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        model.gravity.linear = self.arm.model.gravity.linear
        return model

    def split(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the values of the axes, from the foot on, and of the arm's joints."""
        count = len(self.axes)
        return values[:count][::-1], values[count:]

    def links(self, q: FloatArray) -> list[pin.SE3]:
        """Return the placements of the axes' links in the frame in which both stand."""
        data = self.positioner.createData()
        pin.forwardKinematics(self.positioner, data, self.split(q)[0])
        return [placement.copy() for placement in data.oMi.tolist()[1:]]

    def tool(self, q: FloatArray) -> pin.SE3:
        """Return the placement of the tool in the frame in which both stand."""
        model, data = self.arm.model, self.arm.model.createData()
        pin.framesForwardKinematics(model, data, self.split(q)[1])
        return data.oMf[self.arm.tool_frame_id].copy()

    def tool_in_workpiece(self, q: FloatArray) -> pin.SE3:
        """Return the placement of the tool in the workpiece's frame."""
        return (self.links(q)[-1] * se3(self.workpiece)).actInv(self.tool(q))

    def torques(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Return the torques of all joints in the order of the robot's, by two runs of Pinocchio's algorithm."""
        axes, arm = zip(*map(self.split, (q, v, a)), strict=True)
        carrying = pin.rnea(self.positioner, self.positioner.createData(), *axes)
        return np.concatenate([carrying[::-1], pin.rnea(self.arm.model, self.arm.model.createData(), *arm)])
