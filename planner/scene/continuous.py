"""Clearance at single joint positions, on straight motions between two of them, and of a motion at all times.

The proof checks the middle of an interval of time. The distance of a pair there is reduced by the largest displacement
of both within the interval. If the result is at least the margin, the pair is free on the whole interval. Otherwise the
interval is split, for that pair only. Cheap bounds come first, proved distances only where those do not decide. A
kernel does all of this (`planner/kernels/source/proof.hpp`).

A separating plane of two pieces also separates them at nearby joint positions, if it moves with one of them. Their
supports alone prove their distance along its normal.

Motions are bounded by their length, in any direction. An object that slides over a table at a distance of zero would
need an interval every 10 micrometres. Along the normal d of the plane, a point x of the moving piece goes by
d . (v + w x x) t, plus a part of second order. The first is linear in x and t. The supports of the piece along
d + t (d x w), at both ends of an interval, bound it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planner.errors import InvalidProblem
from planner.scene.checker import AMONG_OBJECTS, CONTACT_TOLERANCE, CONTACTS, ITSELF, CollisionChecker
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
    if checker.is_empty:
        return np.ones(len(rows), dtype=bool)
    return checker.distances.are_free(rows, CONTACT_TOLERANCE)


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


MOST_FIRST_INTERVALS = 32
"""The most intervals that a motion is cut into at first: later ones are cut where it is needed."""

KINDS = (ITSELF, AMONG_OBJECTS, CONTACTS)
"""The kinds of pairs, each of which has a clearance of its own."""

LEAST_INTERVAL_SHARE = 1e-12
"""The least share of a motion that an interval is split down to: below, times are rounding."""


class Budget(NamedTuple):
    """Limits on the work of a proof; counts, so that equal requests get equal answers.

    Attributes:
        positions: The largest number of checked joint positions.
        distances: The most proved distances.
    """

    positions: int = 20_000
    distances: int = 20_000


DEFAULT_BUDGET = Budget()
"""The default budget of a proof."""


class Nearest(NamedTuple):
    """The nearest pair, or a pair below its margin, with its time.

    Attributes:
        distance: m; negative: how deep the two overlap.
        time: s.
        pair: Number of the pair.
        point: (3,), m, in the base frame: a point of the first of the pair.
        margin: The margin of the pair, m.
    """

    distance: float
    time: float
    pair: int
    point: FloatArray
    margin: float

    @property
    def missing(self) -> float:
        """Difference of the margin and the distance of the pair, m."""
        return self.margin - self.distance


@dataclass
class Clearances:
    """The clearance of a motion, for each of the `KINDS` of pairs.

    Attributes:
        lower: (3,), m: no pair of the kind is ever nearer than this; infinite where there is none.
        nearest: The nearest seen of each kind, an upper bound; None: nothing was looked at.
        hit: The pair seen that is nearest beyond its margin; None: there is none.
        undecided: A pair that could not be proved within the budget; None: all are.
        positions: Number of checked joint positions.
        distances: Number of proved distances.
    """

    lower: FloatArray = field(default_factory=lambda: np.full(len(KINDS), np.inf))
    nearest: list[Nearest | None] = field(default_factory=lambda: [None] * len(KINDS))
    hit: Nearest | None = None
    undecided: Nearest | None = None
    positions: int = 0
    distances: int = 0

    @property
    def is_proved(self) -> bool:
        """Whether every pair keeps its margin at all times, up to `CONTACT_TOLERANCE`."""
        return self.hit is None and self.undecided is None

    @property
    def upper(self) -> FloatArray:
        """The distances (3,) of the nearest seen, m; infinite where nothing was looked at."""
        return np.array([np.inf if near is None else near.distance for near in self.nearest])


def clearances(
    checker: CollisionChecker,
    motion: PiecewisePolynomial,
    *,
    tolerance: float | None = None,
    budget: Budget = DEFAULT_BUDGET,
) -> Clearances:
    """Prove that every pair keeps its margin all along a motion, or find one that does not.

    Args:
        checker: The robot and its obstacles.
        motion: The motion of the joints, rad or m.
        tolerance: How well the least distances are measured besides, m; None: they are not, which is faster.
        budget: The limits on the work.
    """
    if checker.is_empty:
        return Clearances()
    measured = np.inf if tolerance is None else tolerance
    request = (CONTACT_TOLERANCE, measured, MOST_FIRST_INTERVALS, LEAST_INTERVAL_SHARE, *budget)
    found = checker.distances.prove(motion.lengths, motion.coefficients, motion.breakpoints, request)

    def seen(row: FloatArray) -> Nearest | None:
        (distance, time), pair = row[:2].tolist(), int(row[2])
        if pair < 0:
            return None
        point, margin = np.full(3, np.nan), float(checker.margins_of(np.array([pair]))[0])
        return Nearest(distance, time, pair, point, margin)

    hit = seen(found.hit)
    if hit is not None:
        placements = checker.bodies.at(motion.evaluate(np.array([hit.time]), [0])[0])
        apart = checker.separate(placements, 0, hit.pair)
        hit = hit._replace(distance=min(hit.distance, apart.distance), point=apart.point)
    nearest = [seen(row) for row in found.nearest]
    undecided = None if hit is not None else seen(found.undecided)
    return Clearances(found.lower, nearest, hit, undecided, found.intervals, found.distances)
