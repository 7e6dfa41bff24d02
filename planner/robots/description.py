"""What a robot is made of, as its readers give it: joints, groups and the description as a whole."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pinocchio as pin

    from planner.errors import Finding

JointKind = Literal["revolute", "continuous", "prismatic"]
Provenance = Literal["published", "datasheet", "estimate", "default"]
LIMITED_QUANTITIES = ("position", "velocity", "acceleration", "jerk", "torque")


@dataclass(frozen=True)
class Joint:
    """One degree of freedom. Angles in rad, lengths in m; infinite: no limit.

    Attributes:
        name: As in `Robot.joint_names`.
        kind: `continuous` is a revolute joint without position limits that may turn for ever.
        lower: Lower position limit.
        upper: Upper position limit.
        velocity: rad/s or m/s.
        acceleration: rad/s^2 or m/s^2.
        jerk: rad/s^3 or m/s^3.
        torque: N m or N.
        provenance: Where each of `LIMITED_QUANTITIES` comes from; no entry where there is no limit.
    """

    name: str
    kind: JointKind
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    acceleration: float = np.inf
    jerk: float = np.inf
    torque: float = np.inf
    provenance: Mapping[str, Provenance] = field(default_factory=dict)

    @property
    def is_angle(self) -> bool:
        """Whether the joint turns (rather than slides)."""
        return self.kind != "prismatic"


@dataclass(frozen=True)
class JointGroup:
    """Joints that belong together, as an SRDF has them.

    Attributes:
        name: Of the group.
        joints: Names of its moving joints, from the root to the tips; those that are not among the robot's are
            held still.
        tip_frame: The link at the end of a group that is one chain; None: it is something else.
    """

    name: str
    joints: tuple[str, ...]
    tip_frame: str | None


@dataclass(frozen=True)
class DisabledCollision:
    """Two links that need no collision check against each other, as an SRDF has them.

    Attributes:
        link_1: Name of a link.
        link_2: Name of another.
        reason: In the words of the SRDF; None: not given.
    """

    link_1: str
    link_2: str
    reason: str | None


@dataclass(frozen=True, eq=False)
class RobotDescription:
    """What a document says about an arm whose configuration is one number per joint, continuous joints included.

    Attributes:
        id: Its name in the catalogue or in the store of uploads.
        source: Where the model comes from, for a person.
        model: Pinocchio model with nq == nv == len(joints), in the order of `joints`. Not to be changed.
        joints: In the order of every joint array.
        tip_frame: Name of the frame at the flange.
        geometry: Simple shapes to look at, a list of plain dictionaries in the format of the catalogue files.
        groups: Joints that belong together, of an uploaded SRDF.
        disabled_collisions: Pairs of links that an uploaded SRDF takes out of collision checks.
        findings: Warnings and remarks about the model, by its reader.
    """

    id: str
    source: str
    model: pin.Model
    joints: tuple[Joint, ...]
    tip_frame: str
    geometry: tuple[Mapping[str, Any], ...] = ()
    groups: tuple[JointGroup, ...] = ()
    disabled_collisions: tuple[DisabledCollision, ...] = ()
    findings: tuple[Finding, ...] = ()
