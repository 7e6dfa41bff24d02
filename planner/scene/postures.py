"""Single postures, and straight ways between two of them: what planners ask many times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import InvalidProblem
from planner.scene.checker import CONTACT_TOLERANCE, Items
from planner.scene.continuous import DEFAULT_BUDGET, clearances
from planner.trajectories.polynomials import PiecewisePolynomial

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from planner.scene.bodies import Postures
    from planner.scene.checker import CollisionChecker
    from planner.scene.continuous import Budget
    from planner.spatial import FloatArray


@dataclass(frozen=True)
class PostureCollision:
    """What is in the way at a posture: the pair that is furthest beyond its margin.

    Attributes:
        pair: Names of the links or objects.
        depth: How much nearer it is than its margin, m: as deep as the two overlap where the margin is 0.

    Examples:
        >>> import planner
        >>> planner.PostureCollision(("link_5", "table"), 0.02).pair
        ('link_5', 'table')
    """

    pair: tuple[str, str]
    depth: float


def is_free(checker: CollisionChecker, positions: ArrayLike) -> np.ndarray:
    """Tell which postures are proved to keep every margin.

    Args:
        checker: The robot and what is around it.
        positions: (N, joints), rad or m.

    Returns:
        (N,), bool.

    Raises:
        InvalidProblem: The positions are not of this robot, or no numbers.

    Examples:
        >>> import planner
        >>> floor = planner.SceneObject("floor", [planner.HalfSpace([0.0, 0.0, 1.0], -0.05)])
        >>> robot = planner.load_robot("kuka_kr16_2")
        >>> checker = planner.CollisionChecker(robot, planner.Scene([floor]))
        >>> planner.is_free(checker, robot.middle[None])
        array([ True])
    """
    postures = checker.bodies.at(_checked(checker, positions))
    free = np.ones(len(postures.origins), dtype=bool)
    items, _, wanted = near_pairs(checker, postures)
    for row, pair, least in zip(items.rows.tolist(), items.pairs.tolist(), wanted.tolist(), strict=True):
        if free[row]:
            free[row] = checker.separate(postures, row, pair).proved >= least
    return free


def collisions_at(checker: CollisionChecker, positions: ArrayLike) -> tuple[PostureCollision | None, ...]:
    """Find what is in the way at postures: of each the pair that is furthest beyond its margin.

    Args:
        checker: The robot and what is around it.
        positions: (N, joints), rad or m.

    Returns:
        One of each posture; None: it is free, as `is_free` tells.

    Raises:
        InvalidProblem: As `is_free`.

    Examples:
        >>> import planner
        >>> block = planner.SceneObject("block", [planner.Box([0.2, 0.2, 0.2])], planner.Pose([0.0, 0.0, 0.7]))
        >>> robot = planner.load_robot("kuka_kr16_2")
        >>> checker = planner.CollisionChecker(robot, planner.Scene([block]))
        >>> (found,) = planner.collisions_at(checker, robot.middle[None])
        >>> found.pair[1]
        'block'
    """
    postures = checker.bodies.at(_checked(checker, positions))
    deepest: list[tuple[float, int]] = [(0.0, -1)] * len(postures.origins)
    items, low, wanted = near_pairs(checker, postures)
    rows = zip(items.rows.tolist(), items.pairs.tolist(), low.tolist(), wanted.tolist(), strict=True)
    for row, pair, bound, least in rows:
        if bound < 0.0 or least - bound > deepest[row][0]:  # a bound that is negative says nothing
            deepest[row] = max(deepest[row], (least - checker.separate(postures, row, pair).proved, pair))
    return tuple(
        None if depth <= 0.0 else PostureCollision(checker.names(pair), depth + CONTACT_TOLERANCE)
        for depth, pair in deepest
    )


def _checked(checker: CollisionChecker, positions: ArrayLike) -> FloatArray:
    """Return joint positions (N, joints) that are those of the robot: nothing would be near it where it is nowhere."""
    rows = np.asarray(positions, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != checker.dof or not np.isfinite(rows).all():
        raise InvalidProblem([(("positions",), f"rows of {checker.dof} numbers are needed, one a joint")])
    return rows


def near_pairs(
    checker: CollisionChecker, postures: Postures, ahead: float = 0.0
) -> tuple[Items, FloatArray, FloatArray]:
    """Find the pairs that cheap bounds do not prove to keep their margins, the nearest first.

    Args:
        checker: The robot and what is around it.
        postures: N postures.
        ahead: What is added to the margins, m.

    Returns:
        The pairs, their bounds (n,), m, and the distances (n,) from which on they keep their margins, m.
    """
    beyond = ahead - CONTACT_TOLERANCE
    count = len(postures.origins)
    own = checker.own_items(count)
    still = np.zeros((count, len(checker.bodies.pieces)))
    near, _ = checker.near_items(postures, still, checker.margins + beyond)
    items = Items(np.concatenate([own.rows, near.rows]), np.concatenate([own.pairs, near.pairs]))
    wanted = checker.margins_of(items.pairs) + beyond
    low = checker.bounds(postures, items, wanted)
    order = np.argsort(low, kind="stable")
    order = order[low[order] < wanted[order]]
    return Items(items.rows[order], items.pairs[order]), low[order], wanted[order]


def is_edge_free(
    checker: CollisionChecker, start: FloatArray, goal: FloatArray, budget: Budget = DEFAULT_BUDGET
) -> bool:
    """Tell whether the straight way between two joint positions (joints,) is proved to keep every margin."""
    return clearances(checker, edge(start, goal), budget=budget).is_proved


def edge(start: FloatArray, goal: FloatArray) -> PiecewisePolynomial:
    """Return the straight way between two joint positions (joints,), of length 1."""
    return PiecewisePolynomial(np.ones(1), np.stack([start, goal - start], axis=-1)[None])
