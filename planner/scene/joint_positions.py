"""Collision checks of single joint positions and of straight motions between two of them, for planners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from planner.errors import InvalidProblem
from planner.scene.checker import CONTACT_TOLERANCE, CollisionChecker
from planner.scene.continuous import clearances
from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial


@dataclass(frozen=True)
class PositionCollision:
    """The collision at a joint position: the pair furthest below its margin.

    Attributes:
        pair: Names of the links or objects.
        depth: Margin minus distance, m; with a margin of 0, the depth of the overlap.

    Examples:
        >>> import planner
        >>> planner.PositionCollision(("link_5", "table"), 0.02).pair
        ('link_5', 'table')
    """

    pair: tuple[str, str]
    depth: float


def is_free(checker: CollisionChecker, positions: ArrayLike) -> np.ndarray:
    """Tell which joint positions provably keep every margin.

    Args:
        checker: The robot and its obstacles.
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
    rows = _checked(checker, positions)
    return np.array([clearances(checker, edge(row, row)).is_proved for row in rows], dtype=bool)


def collisions_at(checker: CollisionChecker, positions: ArrayLike) -> tuple[PositionCollision | None, ...]:
    """Find the collisions at joint positions: for each the pair furthest below its margin.

    Args:
        checker: The robot and its obstacles.
        positions: (N, joints), rad or m.

    Returns:
        One for each joint position; None: it is free, as by `is_free`.

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
    checked = _checked(checker, positions)
    placements = checker.bodies.at(checked)
    deepest: list[tuple[float, int]] = [(0.0, -1)] * len(checked)
    for row, pair, bound, least in zip(*(each.tolist() for each in near_pairs(checker, checked)), strict=True):
        if bound < 0.0 or least - bound > deepest[row][0]:  # a bound that is negative says nothing
            deepest[row] = max(deepest[row], (least - checker.separate(placements, row, pair).proved, pair))
    return tuple(
        None if depth <= 0.0 else PositionCollision(checker.names(pair), depth + CONTACT_TOLERANCE)
        for depth, pair in deepest
    )


def _checked(checker: CollisionChecker, positions: ArrayLike) -> FloatArray:
    """Check joint positions (N, joints): a wrong size or a value that is not finite would pass every check."""
    rows = np.asarray(positions, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != checker.dof or not np.isfinite(rows).all():
        raise InvalidProblem([(("positions",), f"rows of {checker.dof} numbers are needed, one a joint")])
    return rows


def near_pairs(
    checker: CollisionChecker, positions: FloatArray, ahead: float = 0.0
) -> tuple[np.ndarray, np.ndarray, FloatArray, FloatArray]:
    """Find the pairs that cheap bounds do not prove to keep their margins, the nearest first.

    Args:
        checker: The robot and its obstacles.
        positions: (N, joints), rad or m.
        ahead: Addition to the margins, m.

    Returns:
        Row, number and bound, m, of each pair, and the distance, m, above which it keeps its margin.
    """
    beyond = ahead - CONTACT_TOLERANCE
    near = checker.near_items(positions, np.zeros_like(positions), checker.margins + beyond, beyond)
    order = np.argsort(near.bounds, kind="stable")
    pairs = near.pairs[order]
    return near.rows[order], pairs, near.bounds[order], checker.margins_of(pairs) + beyond


def edge(start: FloatArray, goal: FloatArray) -> PiecewisePolynomial:
    """Return the straight way between two joint positions (joints,), of length 1."""
    return PiecewisePolynomial(np.ones(1), np.stack([start, goal - start], axis=-1)[None])
