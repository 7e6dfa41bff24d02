"""Which links of a robot are checked against each other, and why others are not."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from planner.robots.collision.geometry import LinkShape
    from planner.robots.description import DisabledCollision

ReasonUnchecked = Literal["neighbours", "srdf"]


@dataclass(frozen=True)
class CollisionPair:
    """Two links of a robot.

    Attributes:
        link_1: Name of a link.
        link_2: Name of another.
        reason: Why they are not checked against each other: `neighbours` (one joint or none is between them) or `srdf`;
            None: they are.

    Examples:
        >>> import planner
        >>> pairs = planner.load_robot("three_dof_arm").collision_pairs
        >>> planner.CollisionPair("link_1", "link_3", None) in pairs
        True
    """

    link_1: str
    link_2: str
    reason: ReasonUnchecked | None


def collision_pairs(
    shapes: Sequence[LinkShape], parents: Sequence[int], disabled: Iterable[DisabledCollision]
) -> tuple[CollisionPair, ...]:
    """List all pairs of links that have shapes.

    Args:
        shapes: The shapes of the robot.
        parents: The number of the joint before each joint, as Pinocchio's model has them.
        disabled: The pairs that an SRDF takes out.
    """
    joints = {shape.link: shape.joint for shape in shapes}
    known = {frozenset((pair.link_1, pair.link_2)) for pair in disabled}

    def reason(link_1: str, link_2: str) -> ReasonUnchecked | None:
        joint_1, joint_2 = joints[link_1], joints[link_2]
        if joint_1 == joint_2 or joint_1 == parents[joint_2] or joint_2 == parents[joint_1]:
            return "neighbours"
        return "srdf" if frozenset((link_1, link_2)) in known else None

    return tuple(CollisionPair(*links, reason(*links)) for links in combinations(joints, 2))
