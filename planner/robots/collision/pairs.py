"""Which links of a robot are checked against each other, and why others are not."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Literal

import coal
import numpy as np
import pinocchio as pin

from planner.last_used import LastUsed

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from planner.robots.collision.geometry import LinkShape
    from planner.robots.description import DisabledCollision
    from planner.spatial import FloatArray

ReasonUnchecked = Literal["neighbours", "srdf", "always"]

Links = tuple[str, str]

ALWAYS_IN_CONTACT = 0.95
"""Share of random positions from which on two links in contact say nothing about the arm, only about their shapes: what
MoveIt's setup assistant takes."""

FEW_POSITIONS = 20
"""Number of random positions that tell most pairs that are not always in contact from the others."""

MANY_POSITIONS = 400
"""Number of random positions that what is said about contacts rests on: a pair that is in contact in 2 % of all is
missed in one robot of 3,000."""

SEED = 1
"""Start of the random positions: the same robot has the same pairs everywhere."""

PAIRS_KEPT = 2**20
"""Number of pairs that are kept, of the robots last used."""


@dataclass(frozen=True)
class CollisionPair:
    """Two links of a robot.

    Attributes:
        link_1: Name of a link.
        link_2: Name of another.
        reason: Why they are not checked against each other: `neighbours` (at most one joint is between them), `srdf`,
            or `always` (in contact in 95 % of random positions or more); None: they are.

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
    model: pin.Model,
    limits: tuple[FloatArray, FloatArray],
    shapes: Sequence[LinkShape],
    disabled: Iterable[DisabledCollision],
) -> tuple[CollisionPair, ...]:
    """List all pairs of links that have shapes.

    Args:
        model: The arm.
        limits: Lower and upper position limits (joints,), rad or m, infinite where there are none.
        shapes: The shapes of its links.
        disabled: The pairs that an SRDF takes out.
    """
    known = {frozenset((pair.link_1, pair.link_2)) for pair in disabled}
    joints = {shape.link: shape.joint for shape in shapes}
    parents = list(model.parents)

    def reason(links: Links) -> ReasonUnchecked | None:
        joint_1, joint_2 = (joints[link] for link in links)
        if joint_1 == joint_2 or joint_1 == parents[joint_2] or joint_2 == parents[joint_1]:
            return "neighbours"
        return "srdf" if frozenset(links) in known else None

    def listed() -> tuple[CollisionPair, ...]:
        reasons = {links: reason(links) for links in combinations(joints, 2)}
        open_ones = [links for links, why in reasons.items() if why is None]
        for count in (FEW_POSITIONS, MANY_POSITIONS):
            found = contacts(model, limits, shapes, open_ones, count)
            open_ones = [links for links, share in found.items() if share >= ALWAYS_IN_CONTACT]
        reasons |= dict.fromkeys(open_ones, "always")
        return tuple(CollisionPair(*links, why) for links, why in reasons.items())

    placements = [placement.homogeneous for placement in model.jointPlacements.tolist()]
    kinds = ",".join(joint.shortname() for joint in model.joints.tolist()).encode()
    content = b"".join(array.tobytes() for array in (*placements, *limits)) + kinds
    of_shapes = tuple((shape.link, shape.joint, shape.placement.homogeneous.tobytes(), shape.shape) for shape in shapes)
    return _KEPT.get((content, of_shapes, frozenset(known)), listed)


def contacts(
    model: pin.Model,
    limits: tuple[FloatArray, FloatArray],
    shapes: Sequence[LinkShape],
    pairs: Collection[Links],
    count: int = MANY_POSITIONS,
) -> Mapping[Links, float]:
    """Sample how often links are in contact.

    Args:
        model: The arm.
        limits: Lower and upper position limits (joints,), rad or m, infinite where there are none.
        shapes: The shapes of its links.
        pairs: The pairs of links in question.
        count: Number of random positions within the limits; half a turn and 1 m are taken for the limits that are not.

    Returns:
        The share of the positions in which each pair is in contact, from 0 to 1.
    """
    angles = np.array([joint.shortname() == "JointModelRZ" for joint in model.joints.tolist()[1:]])
    widest = np.where(angles, np.pi, 1.0)
    lower, upper = (
        np.where(np.isfinite(limit), limit, side * widest) for limit, side in zip(limits, (-1, 1), strict=True)
    )
    data, request, result = model.createData(), coal.CollisionRequest(), coal.CollisionResult()
    of_link = {link: [shape for shape in shapes if shape.link == link] for links in pairs for link in links}
    hits = dict.fromkeys(pairs, 0)
    for q in np.random.default_rng(SEED).uniform(lower, upper, (count if pairs else 0, len(lower))):
        pin.forwardKinematics(model, data, q)
        posed = {link: [_posed(shape, data) for shape in own] for link, own in of_link.items()}
        for links in pairs:
            for a, b in ((a, b) for a in posed[links[0]] for b in posed[links[1]]):
                result.clear()
                if coal.collide(*a, *b, request, result):
                    hits[links] += 1
                    break
    return {links: hit / count for links, hit in hits.items()}


def _posed(shape: LinkShape, data: pin.Data) -> tuple[coal.CollisionGeometry, coal.Transform3s]:
    placement = data.oMi[shape.joint] * shape.placement
    return shape.shape.geometry, coal.Transform3s(placement.rotation, placement.translation)


_KEPT: LastUsed[tuple[CollisionPair, ...]] = LastUsed(PAIRS_KEPT, len)
"""The pairs of the robots last used, by what they follow from."""
