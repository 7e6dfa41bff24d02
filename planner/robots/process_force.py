"""The force of a process, such as drilling or grinding, that the tool exerts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from planner.spatial import FloatArray, Pose

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class ProcessForce:
    """A constant force and moment that the tool exerts on the workpiece, at the tool centre point.

    The joints need the torques J^T (force, moment) for it, in addition to the torques of the motion.

    Attributes:
        force: (3,), N.
        moment: (3,), N m.
        frame: The axes of both: the tool's, which turn with it, or the base's.
    """

    force: Vector3 = (0.0, 0.0, 0.0)
    moment: Vector3 = (0.0, 0.0, 0.0)
    frame: Literal["tool", "base"] = "tool"

    def __post_init__(self) -> None:
        """Keep plain numbers, which are compared and cannot change."""
        for name in ("force", "moment"):
            x, y, z = map(float, getattr(self, name))
            object.__setattr__(self, name, (x, y, z))

    @property
    def is_finite(self) -> bool:
        """Whether all numbers are finite."""
        return bool(np.isfinite([*self.force, *self.moment]).all())

    def on_chain(self, tool: pin.Frame) -> FloatArray:
        """Return the numbers of `SerialChain.load` after free fall, for the frame of a tool."""
        in_base = self.frame == "base"
        axes = np.eye(3) if in_base else tool.placement.rotation
        vectors = [axes @ np.array(vector) for vector in (self.force, self.moment)]
        return np.hstack([*vectors, tool.placement.translation, tool.parentJoint - 1, in_base])

    def from_frame(self, frame: Pose) -> ProcessForce:
        """Turn a process force given in the axes of a frame, such as a work object's, to the base's axes.

        Args:
            frame: Pose of the frame in the base frame; without a rotation, its axes are the base's.
        """
        rotation = np.eye(3) if frame.rotation is None else frame.rotation
        force, moment = (rotation @ np.array([self.force, self.moment]).T).T
        return ProcessForce(tuple(force), tuple(moment), "base")
