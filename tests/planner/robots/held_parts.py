"""An arm that holds a part under a fixed tool, as Pinocchio's model of the arm alone, which stands in the world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from planner.robots import Robot
from planner.spatial import FloatArray, Pose
from tests.planner.robots.two_branches import se3


@dataclass(frozen=True, eq=False)
class HeldPart:
    """The arm alone, with the payload that the part is, and a tool that stands beside it.

    Attributes:
        arm: The arm, with its mounting.
        fixed_tool: The tool in the arm's base frame.
        workpiece: Pose of the part in the tip frame.
    """

    arm: Robot
    fixed_tool: Pose
    workpiece: Pose

    @cached_property
    def robot(self) -> Robot:
        """The robot of the library with both."""
        return self.arm.derived(id="cell", fixed_tool=self.fixed_tool, workpiece=self.workpiece)

    def part(self, q: FloatArray) -> pin.SE3:
        """Return the placement of the part in the arm's base frame, at joint positions in the order of the robot's."""
        data = self.arm.model.createData()
        pin.framesForwardKinematics(self.arm.model, data, q[::-1].copy())
        return data.oMf[self.arm.tip_frame_id] * se3(self.workpiece)

    def tool_in_part(self, q: FloatArray) -> pin.SE3:
        """Return the placement of the tool in the frame of the part."""
        return self.part(q).actInv(se3(self.fixed_tool))

    def rates(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the velocity of the tool, m/s, and its angular velocity, rad/s, relative to the part in its axes."""
        data, axes = self.arm.model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(self.arm.model, data, q[::-1].copy(), v[::-1].copy())
        of_tip = pin.getFrameVelocity(self.arm.model, data, self.arm.tip_frame_id, axes)
        tip = pin.updateFramePlacement(self.arm.model, data, self.arm.tip_frame_id)
        at_tool = of_tip.linear + np.cross(of_tip.angular, np.array(self.fixed_tool.position) - tip.translation)
        turned = self.part(q).rotation.T
        return -turned @ at_tool, -turned @ of_tip.angular

    def torques(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        """Return the torques of all joints in the order of the robot's, by Pinocchio's algorithm on the arm."""
        model = self.arm.model
        found: FloatArray = pin.rnea(model, model.createData(), *(values[::-1].copy() for values in (q, v, a)))
        return found[::-1]
