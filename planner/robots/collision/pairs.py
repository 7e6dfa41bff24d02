"""Pairs of links and shapes for the self-collision check, and the reasons for leaving out others."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Literal

import coal
import numpy as np
import pinocchio as pin

from planner.last_used import LastUsed
from planner.robots.collision.geometry import LinkShape
from planner.spatial import FloatArray

ReasonUnchecked = Literal["neighbours", "srdf", "always"]

Links = tuple[str, str]

Shapes = tuple[int, int]
"""Numbers of two shapes of a robot."""

ALWAYS_IN_CONTACT = 0.95
"""Fraction of random positions with contact above which a contact of two shapes is a property of the shapes.

MoveIt's setup assistant uses the same fraction.
"""

FEW_POSITIONS = 20
"""Number of random positions that tell most pairs that are not always in contact from the others."""

MANY_POSITIONS = 400
"""Number of random positions for the statistics of contacts.

They miss a pair in contact in 2 % of all positions for one robot in 3,000.
"""

SEED = 1
"""Start of the random positions: the same robot has the same pairs everywhere."""

PAIRS_KEPT = 2**20
"""Number of pairs that are kept, of the robots last used."""


@dataclass(frozen=True)
class DisabledCollision:
    """Two links that need no collision check against each other, as an SRDF has them.

    Attributes:
        link_1: Name of a link.
        link_2: Name of another.
        reason: The reason in the words of the SRDF; None: not given.
    """

    link_1: str
    link_2: str
    reason: str | None


@dataclass(frozen=True)
class CollisionPair:
    """Two links of a robot.

    Attributes:
        link_1: Name of a link.
        link_2: Name of another.
        reason: Reason for not checking the pair: `neighbours` (no joint is between them), `srdf`, or `always`.
            `always`: all their shapes are in contact in at least 95 % of random positions. None: the pair is checked.
        always_touching: The shapes of a checked pair that are left out: they are in contact in at least 95 % of random
            positions. The numbers are indices in `Robot.collision_shapes`, of `link_1` and of `link_2`.

    Examples:
        >>> import planner
        >>> pairs = planner.load_robot("three_dof_arm").collision_pairs
        >>> planner.CollisionPair("link_1", "link_3", None) in pairs
        True
    """

    link_1: str
    link_2: str
    reason: ReasonUnchecked | None
    always_touching: tuple[Shapes, ...] = ()

    def checked_shapes(self, of_link: Mapping[str, Sequence[int]]) -> list[Shapes]:
        """List the shapes that are checked against each other.

        Args:
            of_link: The numbers of the shapes in question, by their links.
        """
        if self.reason is not None:
            return []
        left_out = set(self.always_touching)
        both = product(of_link.get(self.link_1, ()), of_link.get(self.link_2, ()))
        return [shapes for shapes in both if shapes not in left_out]


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
    of_link = shapes_of_links(shapes)

    def reason(links: Links) -> ReasonUnchecked | None:
        if joints[links[0]] == joints[links[1]]:
            return "neighbours"
        return "srdf" if frozenset(links) in known else None

    def listed() -> tuple[CollisionPair, ...]:
        pairs = [CollisionPair(*links, reason(links)) for links in combinations(joints, 2)]
        touching: set[tuple[Shapes, ...]] = {(both,) for pair in pairs for both in pair.checked_shapes(of_link)}
        for count in (FEW_POSITIONS, MANY_POSITIONS):
            found = contacts(model, limits, shapes, sorted(touching), count)
            touching = {group for group, share in found.items() if share >= ALWAYS_IN_CONTACT}
        return tuple(_without_touching(pair, of_link, touching) for pair in pairs)

    placements = [placement.homogeneous for placement in model.jointPlacements.tolist()]
    kinds = ",".join(joint.shortname() for joint in model.joints.tolist()).encode()
    content = b"".join(array.tobytes() for array in (*placements, *limits)) + kinds
    of_shapes = tuple((shape.link, shape.joint, shape.placement.homogeneous.tobytes(), shape.shape) for shape in shapes)
    return _KEPT.get((content, of_shapes, frozenset(known)), listed)


def shapes_of_links(shapes: Sequence[LinkShape]) -> Mapping[str, Sequence[int]]:
    """Return the numbers of the shapes of each link."""
    of_link: dict[str, list[int]] = {}
    for number, shape in enumerate(shapes):
        of_link.setdefault(shape.link, []).append(number)
    return of_link


def _without_touching(
    pair: CollisionPair, of_link: Mapping[str, Sequence[int]], touching: Collection[tuple[Shapes, ...]]
) -> CollisionPair:
    """Return a pair without the shapes that always touch: the whole pair where all of them do."""
    checked = pair.checked_shapes(of_link)
    left_out = tuple(both for both in checked if (both,) in touching)
    if checked and len(left_out) == len(checked):
        return replace(pair, reason="always")
    return replace(pair, always_touching=left_out)


def contacts(
    model: pin.Model,
    limits: tuple[FloatArray, FloatArray],
    shapes: Sequence[LinkShape],
    groups: Collection[tuple[Shapes, ...]],
    count: int = MANY_POSITIONS,
) -> Mapping[tuple[Shapes, ...], float]:
    """Sample the contacts of shapes.

    Args:
        model: The arm.
        limits: Lower and upper position limits (joints,), rad or m, infinite where there are none.
        shapes: The shapes of its links.
        groups: Pairs of shapes; a group is in contact where one of its pairs is.
        count: Number of random positions within the limits; half a turn and 1 m are taken for the limits that are not.

    Returns:
        The share of the positions in which each group is in contact, from 0 to 1.
    """
    angles = np.array([joint.shortname() == "JointModelRZ" for joint in model.joints.tolist()[1:]])
    widest = np.where(angles, np.pi, 1.0)
    lower, upper = (
        np.where(np.isfinite(limit), limit, side * widest) for limit, side in zip(limits, (-1, 1), strict=True)
    )
    data, request, result = model.createData(), coal.CollisionRequest(), coal.CollisionResult()
    needed = {number for group in groups for both in group for number in both}
    hits = dict.fromkeys(groups, 0)
    for q in np.random.default_rng(SEED).uniform(lower, upper, (count if groups else 0, len(lower))):
        pin.forwardKinematics(model, data, q)
        placed = {number: data.oMi[shapes[number].joint] * shapes[number].placement for number in needed}
        posed = {
            number: (shapes[number].shape.geometry, coal.Transform3s(at.rotation, at.translation))
            for number, at in placed.items()
        }
        for group in groups:
            for first, second in group:
                result.clear()
                if coal.collide(*posed[first], *posed[second], request, result):
                    hits[group] += 1
                    break
    return {group: hit / count for group, hit in hits.items()}


_KEPT: LastUsed[tuple[CollisionPair, ...]] = LastUsed(PAIRS_KEPT, len)
"""The pairs of the last robots used, by their inputs."""
