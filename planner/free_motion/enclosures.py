"""A proof that there is no way: what the first joints alone move cannot pass between the objects.

The ranges of the first joints are cut into cells. A cell is blocked where a ball inside of a link is too near to an
object at its middle by more than these joints can move the center of the ball within the cell: then every posture in it
collides, whatever the other joints do. If the cells that are not blocked do not lead from the start to a goal, no
motion does (a cell decomposition, Latombe, Robot Motion Planning, 1991, chapter 6, of fewer joints than there are).
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.free_motion.inner_balls import distance_bounds, faces, inner_balls
from planner.scene import CONTACT_TOLERANCE
from planner.shapes import ConvexHull, Shape
from planner.tolerances import ROUNDING

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.scene import CollisionChecker
    from planner.spatial import FloatArray

ATTEMPTS = ((1, 0.05), (2, 0.1), (2, 0.05))
"""How many joints are looked at and how wide the cells are, rad or m, one after the other: a third joint would take
minutes."""

FEW = 20.0
"""Number of objects up to which as many cells are looked at as may be; among more of them fewer are, since each takes
longer: so a search that fails in a full scene ends in as much time as one in an empty one."""

FACES_OF_ONE = 8.0
"""The number of faces of a hull that take as long as a box does."""

AT_ONCE = 200_000
"""The number of distances of balls from an object that are computed together: some MiB."""

MOST_CELLS = 2**24
"""The most cells that there may be, one byte each: a robot that goes many metres has more."""


class Enclosure(NamedTuple):
    """What keeps a robot from its goals.

    Attributes:
        joints: The number of joints, the first ones, that cannot get there whatever the others do.
        objects: The names of the objects that are in their way.
    """

    joints: int
    objects: tuple[str, ...]


def find_enclosure(
    robot: Robot, checker: CollisionChecker, start: FloatArray, goals: FloatArray, most_cells: int
) -> Enclosure | None:
    """Prove that no motion leads from a start to any goal, if a few joints are enough for it.

    Args:
        robot: The arm, whose position limits its motions keep.
        checker: The arm and what is around it; point clouds, and the arm against itself, are left out.
        start: (joints,), free, rad or m.
        goals: (goals, joints), free.
        most_cells: The most cells that are looked at in each of a few attempts, among few objects.

    Returns:
        What is in the way; None: nothing is proved.
    """
    for count, width in ATTEMPTS:
        if count > robot.dof:
            break
        cells = _Cells.of(robot, count, width)
        links = _Balls(robot, checker, count)
        if cells is None or not len(links.radii) or links.is_far:
            continue
        most = int(most_cells * FEW / max(FEW, links.cost))
        objects = _enclosing(cells, links, start[:count], goals[:, :count], most)
        if objects is not None:
            return Enclosure(count, objects)
    return None


class _Cells(NamedTuple):
    """The ranges of the first joints in cells.

    Attributes:
        lower: (joints,): where the ranges begin, rad or m.
        widths: (joints,): of a cell.
        counts: Number of cells along each joint.
        turns: (joints,), bool: whether the last cell of a joint is beside its first.
    """

    lower: FloatArray
    widths: FloatArray
    counts: tuple[int, ...]
    turns: np.ndarray

    @classmethod
    def of(cls, robot: Robot, count: int, width: float) -> _Cells | None:
        """Cut the ranges of so many joints; None: one slides without end, or there would be too many cells."""
        lower, upper = robot.limit("lower")[:count], robot.limit("upper")[:count]
        turns = ~np.isfinite(upper - lower)
        if (turns & ~robot.is_angle[:count]).any():
            return None
        lower, upper = np.where(turns, -np.pi, lower), np.where(turns, np.pi, upper)
        counts = np.maximum(1.0, np.ceil((upper - lower) / width))
        if counts.prod() > MOST_CELLS:
            return None
        return cls(lower, (upper - lower) / counts, tuple(counts.astype(int).tolist()), turns)

    def containing(self, positions: FloatArray) -> np.ndarray:
        """Return the cells (N, joints) that positions (N, joints) are in."""
        since = np.where(self.turns, np.mod(positions - self.lower, 2.0 * np.pi), positions - self.lower)
        counts = np.array(self.counts)
        rows = np.floor(since / np.where(self.widths > 0.0, self.widths, 1.0)).astype(int)
        return np.asarray(np.clip(rows, 0, counts - 1))

    def middles(self, cells: np.ndarray) -> FloatArray:
        """Return the middles (N, joints) of cells (N, joints), rad or m."""
        return np.asarray(self.lower + (cells + 0.5) * self.widths, dtype=np.float64)

    def beside(self, cells: np.ndarray) -> np.ndarray:
        """Return the cells that touch one of some cells (N, joints), with repetitions."""
        steps = np.array([step for step in product((-1, 0, 1), repeat=len(self.counts)) if any(step)])
        found = (cells[:, None] + steps).reshape(-1, len(self.counts))
        counts = np.array(self.counts)
        found = np.where(self.turns, found % counts, found)
        return np.asarray(found[((found >= 0) & (found < counts)).all(axis=1)])


class _Balls:
    """Balls inside of all that the first joints move and no other joint does."""

    def __init__(self, robot: Robot, checker: CollisionChecker, count: int) -> None:
        bodies = checker.bodies
        moved = [n for n, piece in enumerate(bodies.pieces) if piece.joint and not bodies.is_moved[n, count:].any()]
        balls = [inner_balls(bodies.pieces[n].shape) for n in moved]
        placed = [(bodies.pieces[n], centers) for n, (centers, _) in zip(moved, balls, strict=True)]
        self._bodies, self._dof, self._count = bodies, robot.dof, count
        self._objects = [
            (obstacle, obstacle.shape, checker.margins[:, k])
            for k, obstacle in enumerate(checker.obstacles.all)
            if isinstance(obstacle.shape, Shape)
        ]
        self._of = np.repeat(np.array(moved, dtype=int), [len(radii) for _, radii in balls])
        self._centers = np.concatenate(
            [np.zeros((0, 3)), *(c @ piece.rotation.T + piece.translation for piece, c in placed)]
        )
        self.radii = np.concatenate([np.zeros(0), *(radii for _, radii in balls)])

    @property
    def cost(self) -> float:
        """How many boxes take as long to be looked at as the objects."""
        shapes = [shape for _, shape, _ in self._objects]
        return sum(len(faces(s)) / FACES_OF_ONE if isinstance(s, ConvexHull) else 1.0 for s in shapes)

    @property
    def is_far(self) -> bool:
        """Whether there is nothing to be held against."""
        return not self._objects

    def blocked(self, middles: FloatArray, widths: FloatArray) -> np.ndarray:
        """Find the numbers of objects (N,) that all postures of cells collide with, -1 where none is known.

        Args:
            middles: Of the cells (N, joints), rad or m.
            widths: Of every cell (joints,).
        """
        step = max(1, AT_ONCE // len(self.radii))
        found = [self._blocked(middles[k : k + step], widths) for k in range(0, len(middles), step)]
        return np.concatenate(found)

    def names(self, numbers: np.ndarray) -> tuple[str, ...]:
        """Return the names of objects, in alphabetical order."""
        return tuple(sorted({self._objects[number][0].name for number in numbers.tolist()}))

    def _blocked(self, middles: FloatArray, widths: FloatArray) -> np.ndarray:
        positions = np.zeros((len(middles), self._dof))
        positions[:, : self._count] = middles
        rotations, origins = self._bodies.frames(positions)
        joints = self._bodies.joints[self._of]
        centers = np.einsum("nbxy,by->nbx", rotations[:, joints], self._centers) + origins[:, joints]
        reach = self.radii - self._moved(rotations, origins, centers, widths) - ROUNDING * 10.0 - CONTACT_TOLERANCE
        found = np.full(len(middles), -1)
        for number, (obstacle, shape, margins) in enumerate(self._objects):
            near = distance_bounds(shape, (centers - obstacle.translation) @ obstacle.rotation)
            found[(near < reach + margins[self._of]).any(axis=1)] = number
        return found

    def _moved(self, rotations: FloatArray, origins: FloatArray, centers: FloatArray, widths: FloatArray) -> FloatArray:
        """Bound how far the joints move the centers (N, balls, 3) within half a cell: (N, balls), m."""
        moved = np.zeros(centers.shape[:2])
        for joint, width in enumerate(widths.tolist()):
            mine = self._bodies.is_moved[self._of, joint]
            if not self._bodies.is_angle[joint]:
                moved += np.where(mine, width / 2.0, 0.0)
                continue
            arm = centers - origins[:, joint + 1][:, None]
            axis = rotations[:, joint + 1, :, 2][:, None]
            along = (arm * axis).sum(axis=-1)
            from_axis = np.sqrt(np.maximum((arm**2).sum(axis=-1) - along**2, 0.0))
            moved += np.where(mine, 2.0 * np.sin(min(width / 2.0, np.pi) / 2.0) * from_axis, 0.0)
        return moved


def _enclosing(cells: _Cells, links: _Balls, start: FloatArray, goals: FloatArray, most: int) -> tuple[str, ...] | None:
    """Flood the cells from both sides; name what encloses one of them, if that is so before they meet."""
    fronts = [cells.containing(start[None]), np.unique(cells.containing(goals), axis=0)]
    seen = [np.zeros(cells.counts, dtype=bool) for _ in fronts]
    sizes, blocking = [0, 0], [np.zeros(0, dtype=int), np.zeros(0, dtype=int)]
    for side, front in enumerate(fronts):
        seen[side][tuple(front.T)] = True
    while sum(sizes) < most:
        side = int(sizes[1] < sizes[0])
        if seen[1 - side][tuple(fronts[side].T)].any():
            return None  # what the other side has seen may be blocked: but then it is here, too
        around = np.unique(cells.beside(fronts[side]), axis=0)
        new = around[~seen[side][tuple(around.T)]]
        seen[side][tuple(new.T)] = True
        sizes[side] += len(new)
        by = links.blocked(cells.middles(new), cells.widths) if len(new) else np.zeros(0, dtype=int)
        blocking[side] = np.union1d(blocking[side], by[by >= 0])
        fronts[side] = new[by < 0]
        if not len(fronts[side]):
            return links.names(blocking[side])
    return None
