"""A robot among objects: which pieces are held against which, and cheap lower bounds of all their distances."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.scene.bodies import Bodies, Body, Postures
from planner.scene.faults import refuse_faults
from planner.scene.obstacles import Obstacles
from planner.scene.point_cloud import Cluster
from planner.scene.scene import Scene
from planner.scene.segments import segment_distances
from planner.scene.separations import Placed, Separation, cluster_separation, separation

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.robots import Robot
    from planner.scene.scene import AttachedObject
    from planner.shapes import Shape
    from planner.spatial import FloatArray

CONTACT_TOLERANCE = 1e-5
"""Distance, m, by which a pair may be nearer than its margin and still keep it: touching is free up to rounding, and
GJK's plane proves distances of curved shapes to some micrometres."""

UNKNOWN = -1e9
"""The lower bound of distances of which nothing is known, m."""

ITSELF = 0
"""Number of the pairs between pieces that move."""

AMONG_OBJECTS = 1
"""Number of the pairs of a piece that moves and one that stands still."""

CONTACTS = 2
"""Number of those among them that have a least distance of their own, since they may touch: `Scene.pair_margins`."""

MOST_LOOKED_AT = 64
"""Number of groups of obstacles, and then of obstacles in them, among which the nearest is sought."""

MOST_KEPT = 16
"""Number of checkers that a process keeps: remedies are tried, and edges planned, with the same few."""


class Items(NamedTuple):
    """Pairs of pieces at postures, one a row.

    Attributes:
        rows: (n,): number of the posture.
        pairs: (n,): number of the pair.
    """

    rows: np.ndarray
    pairs: np.ndarray


class CollisionChecker:
    """A robot, what it carries, and what stands around it.

    Pairs have numbers: those of pieces that move first, then those of every such piece with every obstacle.

    Examples:
        >>> import planner
        >>> floor = planner.SceneObject("floor", [planner.HalfSpace([0.0, 0.0, 1.0], -0.05)])
        >>> checker = planner.CollisionChecker(planner.load_robot("kuka_kr16_2"), planner.Scene([floor]))
        >>> checker.is_empty
        False

    Attributes:
        bodies: The pieces that move.
        obstacles: The pieces that stand still.
        first: (own pairs,): number of the body that moves less, of each pair of bodies.
        second: (own pairs,): number of the other one.
        margins: (bodies, obstacles), m: least distance asked; negative without end where none is.
        asked: Of each kind of pairs with obstacles that there is, its number, and which (bodies, obstacles), bool, are.
    """

    def __init__(self, robot: Robot, scene: Scene | None = None, *, self_collision: bool | None = None) -> None:
        """Prepare the checks.

        Args:
            robot: The arm, with its tool and mounting.
            scene: What is around it; None: nothing.
            self_collision: Whether the arm is held against itself, and against what it carries; None: by all
                shapes but the coarse ones, capsules along its kinematics.

        Raises:
            InvalidProblem: The scene names a link that there is not, or uses a name twice.
        """
        self.scene = scene or Scene()
        self.dof = robot.dof
        refuse_faults(robot, self.scene)
        shapes = robot.collision_shapes
        links = [
            Body(shape.link, shape.joint, shape.placement.rotation, shape.placement.translation, shape.shape)
            for shape in shapes
        ]
        carried = [body for thing in self.scene.attached for body in _bodies_of(robot, thing)]
        self.bodies = Bodies(robot, [*links, *carried])
        self.obstacles = Obstacles(self.scene.objects, robot.mounting)
        self._joints = np.append(self.bodies.joints, np.zeros(len(self.obstacles.all), dtype=int))
        self._allowed = {frozenset(pair) for pair in self.scene.allowed_pairs}
        fine = {k for k, shape in enumerate(shapes) if self_collision or not shape.is_coarse}
        pairs = [] if self_collision is False else list(self._own_pairs(robot, len(links), fine))
        self.first, self.second = np.array(pairs, dtype=int).reshape(-1, 2).T
        moved = self.bodies.is_moved
        self._by_second = moved[self.second] & ~moved[self.first]
        self._by_first = moved[self.first] & ~moved[self.second]
        self._uncertainties = np.zeros(len(self.bodies.pieces))
        self._uncertainties[: len(shapes)] = [shape.uncertainty for shape in shapes]
        self.margins, self._may_be_near = self._margins()
        asked = np.isfinite(self.margins)
        by_kind = {AMONG_OBJECTS: asked & ~self._may_be_near, CONTACTS: asked & self._may_be_near}
        self.asked = {kind: pairs for kind, pairs in by_kind.items() if pairs.any()}

    @property
    def own_pairs(self) -> int:
        """The number of pairs of pieces that move."""
        return len(self.first)

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to be held against anything."""
        return not self.own_pairs and not self.asked

    def all_pairs(self) -> np.ndarray:
        """Return the numbers (n,) of all pairs that are held against each other."""
        among = np.flatnonzero(np.isfinite(self.margins))
        return np.concatenate([np.arange(self.own_pairs), self.own_pairs + among])

    def kinds(self, pairs: np.ndarray) -> np.ndarray:
        """Return `ITSELF`, `AMONG_OBJECTS` or `CONTACTS` of pairs (n,)."""
        kinds = np.full(len(pairs), ITSELF)
        among = pairs >= self.own_pairs
        kinds[among] = np.where(self._may_be_near.ravel()[pairs[among] - self.own_pairs], CONTACTS, AMONG_OBJECTS)
        return kinds

    def uncertainty(self, kind: int) -> float:
        """Return by how much the machine may be nearer than the shapes of a kind of pairs, m; 0: none is estimated."""
        if kind == ITSELF:
            return float((self._uncertainties[self.first] + self._uncertainties[self.second]).max(initial=0.0))
        pairs = self.asked.get(kind)
        return 0.0 if pairs is None else float(self._uncertainties[pairs.any(axis=1)].max(initial=0.0))

    def names(self, pair: int) -> tuple[str, str]:
        """Return the names of what a pair consists of."""
        if pair < self.own_pairs:
            numbers = int(self.first[pair]), int(self.second[pair])
            return self.bodies.pieces[numbers[0]].name, self.bodies.pieces[numbers[1]].name
        body, obstacle = divmod(pair - self.own_pairs, len(self.obstacles.all))
        return self.bodies.pieces[body].name, self.obstacles.all[obstacle].name

    def margins_of(self, pairs: np.ndarray) -> FloatArray:
        """Return the least distance asked of pairs (n,), m."""
        margins = np.zeros(len(pairs))
        among = pairs >= self.own_pairs
        margins[among] = self.margins.ravel()[pairs[among] - self.own_pairs]
        return margins

    def own_items(self, count: int) -> Items:
        """Return all pairs of pieces that move, at so many postures."""
        rows, pairs = np.divmod(np.arange(count * self.own_pairs), max(self.own_pairs, 1))
        return Items(rows, pairs)

    def nearest_item(self, postures: Postures, wanted: FloatArray) -> tuple[int, int]:
        """Return the posture and the number of the pair with an obstacle that is nearest, as far as bounds tell.

        Args:
            postures: N postures.
            wanted: From which distance on pairs are apart (bodies, obstacles), m; -inf of those that do not count.
        """
        centers, radii = self._spheres(postures)
        low = self.obstacles.group_distances(centers) - radii[..., None]
        low[:, ~np.isfinite(self.obstacles.group_margins(wanted))] = np.inf
        nearest = _least(low.ravel(), MOST_LOOKED_AT)
        rows, bodies, groups = np.unravel_index(nearest[np.isfinite(low.ravel()[nearest])], low.shape)
        obstacles, of = self.obstacles.in_groups(groups)
        asked = np.isfinite(wanted[bodies[of], obstacles])
        rows, bodies, obstacles = rows[of[asked]], bodies[of[asked]], obstacles[asked]
        low = self.obstacles.sphere_distances(centers[rows, bodies], obstacles) - radii[rows, bodies]
        nearest = _least(low, MOST_LOOKED_AT)
        pairs = self.own_pairs + bodies * len(self.obstacles.all) + obstacles
        items = Items(rows[nearest], pairs[nearest])
        best = np.argmin(self._scene_bounds(postures, items, np.full(len(nearest), np.inf)))
        return int(items.rows[best]), int(items.pairs[best])

    def near_items(self, postures: Postures, moved: FloatArray, wanted: FloatArray) -> tuple[Items, float]:
        """Find the pairs with obstacles that spheres, about groups of obstacles and then about each, leave too near.

        Args:
            postures: N postures.
            moved: How much nearer the bodies may come (N, bodies), m.
            wanted: From which distance on pairs are apart (bodies, obstacles), m; -inf where none is asked.

        Returns:
            The pairs, and the least bound of the other ones, m.
        """
        centers, radii = self._spheres(postures)
        reach = radii + moved
        low = self.obstacles.group_distances(centers) - reach[..., None]
        wanted_of_groups = self.obstacles.group_margins(wanted)
        left = low < wanted_of_groups
        least = low[~left & np.isfinite(wanted_of_groups)].min(initial=np.inf)
        rows, bodies, groups = np.nonzero(left)
        obstacles, of = self.obstacles.in_groups(groups)
        rows, bodies = rows[of], bodies[of]
        low = self.obstacles.sphere_distances(centers[rows, bodies], obstacles) - reach[rows, bodies]
        asked = wanted[bodies, obstacles]
        left = low < asked
        least = low[~left & np.isfinite(asked)].min(initial=least)
        pairs = self.own_pairs + bodies[left] * len(self.obstacles.all) + obstacles[left]
        return Items(rows[left], pairs), float(least)

    def _spheres(self, postures: Postures) -> tuple[FloatArray, FloatArray]:
        """Return the centers (N, bodies, 3) and radii (N, bodies) of spheres about the bodies, m."""
        ends = postures.spheres[:, :, [0, -1]]
        centers = ends.sum(axis=2) / 2.0
        return centers, np.linalg.norm(ends[:, :, 1] - centers, axis=-1) + self.bodies.radii

    def bounds(self, postures: Postures, items: Items, enough: FloatArray) -> FloatArray:
        """Bound the distances of pairs at postures from below, negative ones as well.

        Args:
            postures: N postures.
            items: n pairs at postures.
            enough: The bounds (n,) from which on no better ones are needed, m.

        Returns:
            (n,), m.
        """
        low = np.empty(len(items.rows))
        own = items.pairs < self.own_pairs
        if own.any():
            low[own] = self._own_bounds(postures, Items(items.rows[own], items.pairs[own]))
        if not own.all():
            low[~own] = self._scene_bounds(postures, Items(items.rows[~own], items.pairs[~own]), enough[~own])
        return low

    def _scene_bounds(self, postures: Postures, items: Items, enough: FloatArray) -> FloatArray:
        """Bound the distances of pairs with obstacles: by boxes first, and clusters that these leave ball by ball."""
        bodies, obstacles = np.divmod(items.pairs - self.own_pairs, len(self.obstacles.all))
        spheres = postures.spheres[items.rows, bodies]
        low = np.empty(len(items.rows))
        boxed = obstacles < len(self.obstacles.pieces)
        near = self.obstacles.box_distances(spheres[boxed], obstacles[boxed]).min(axis=1)
        near -= self.bodies.sphere_radii[bodies[boxed]]
        low[boxed] = np.where(near >= 0.0, near, UNKNOWN)  # boxes that are met say nothing of how deep pieces overlap
        planes = obstacles[~boxed] - len(self.obstacles.pieces)
        heights = self.obstacles.plane_distances(spheres[~boxed], planes).min(axis=1)
        low[~boxed] = heights - self.bodies.radii[bodies[~boxed]]
        left = np.flatnonzero(boxed & (low < enough))
        left = left[self.obstacles.has_balls(obstacles[left])]
        balls = self.obstacles.ball_distances(spheres[left, 0], spheres[left, -1], obstacles[left])
        low[left] = np.maximum(low[left], balls - self.bodies.radii[bodies[left]])
        return low

    def _own_bounds(self, postures: Postures, items: Items) -> FloatArray:
        first, second = self.first[items.pairs], self.second[items.pairs]
        ends = (postures.spheres[items.rows, body][:, k] for body in (first, second) for k in (0, -1))
        radii: FloatArray = self.bodies.radii[first] + self.bodies.radii[second]
        return segment_distances(*ends) - radii

    def motions(self, displacements: FloatArray, items: Items) -> FloatArray:
        """Bound how much nearer pairs may come by displacements (N, bodies, joints): (n,), m."""
        moved = np.empty(len(items.rows))
        own = items.pairs < self.own_pairs
        rows, pairs = items.rows[own], items.pairs[own]
        of_second = (displacements[rows, self.second[pairs]] * self._by_second[pairs]).sum(axis=1)
        of_first = (displacements[rows, self.first[pairs]] * self._by_first[pairs]).sum(axis=1)
        moved[own] = of_first + of_second
        bodies = (items.pairs[~own] - self.own_pairs) // max(len(self.obstacles.all), 1)
        moved[~own] = displacements.sum(axis=2)[items.rows[~own], bodies]
        return moved

    def numbers_of(self, pairs: np.ndarray) -> np.ndarray:
        """Return the numbers of the two pieces of pairs (n, 2): bodies first, and then obstacles."""
        numbers = np.empty((len(pairs), 2), dtype=int)
        own = pairs < self.own_pairs
        numbers[own, 0], numbers[own, 1] = self.first[pairs[own]], self.second[pairs[own]]
        body, obstacle = np.divmod(pairs[~own] - self.own_pairs, max(len(self.obstacles.all), 1))
        numbers[~own, 0], numbers[~own, 1] = body, obstacle + len(self.bodies.pieces)
        return numbers

    def joints_of(self, pairs: np.ndarray) -> np.ndarray:
        """Return the numbers of the joints that the two pieces of pairs move with (n, 2); 0: an obstacle's."""
        joints: np.ndarray = self._joints[self.numbers_of(pairs)]
        return joints

    def placed_shape(self, number: int) -> tuple[int, FloatArray, FloatArray, Shape | Cluster]:
        """Return the joint, and in its frame the rotation (3, 3), translation (3,) and shape of a body or obstacle."""
        if number < len(self.bodies.pieces):
            piece = self.bodies.pieces[number]
            return piece.joint, piece.rotation, piece.translation, piece.shape
        obstacle = self.obstacles.all[number - len(self.bodies.pieces)]
        return 0, obstacle.rotation, obstacle.translation, obstacle.shape

    def separate(self, postures: Postures, row: int, pair: int) -> Separation:
        """Compute how far a pair is apart at one posture, with proof."""
        if pair < self.own_pairs:
            first, second = (self._placed(postures, row, int(body[pair])) for body in (self.first, self.second))
            return separation(first, second)
        body, number = divmod(pair - self.own_pairs, len(self.obstacles.all))
        obstacle, placed = self.obstacles.all[number], self._placed(postures, row, body)
        if isinstance(obstacle.shape, Cluster):
            return cluster_separation(placed, self.obstacles.balls(number))
        return separation(placed, Placed(obstacle.shape, obstacle.rotation, obstacle.translation))

    def _placed(self, postures: Postures, row: int, body: int) -> Placed:
        piece = self.bodies.pieces[body]
        rotation, origin = postures.rotations[row, piece.joint], postures.origins[row, piece.joint]
        return Placed(piece.shape, rotation @ piece.rotation, rotation @ piece.translation + origin)

    def _own_pairs(self, robot: Robot, links: int, fine: set[int]) -> Iterator[tuple[int, int]]:
        """Yield the pairs of bodies that are held against each other: the robot's own, then those with what it carries.

        What an object is attached to may touch it, and so may another object that is attached there.

        Args:
            robot: The arm.
            links: The number of its own pieces, which come first.
            fine: The numbers of those that count.
        """
        pieces = self.bodies.pieces
        of_link: dict[str, list[int]] = {}
        for number in sorted(fine):
            of_link.setdefault(pieces[number].name, []).append(number)
        for pair in robot.collision_pairs:
            if not self._may_touch(pair.link_1, pair.link_2):
                yield from pair.checked_shapes(of_link)
        touched = {thing.id: {thing.link or robot.tip_frame, *thing.touch_links} for thing in self.scene.attached}
        for second in range(links, len(pieces)):
            held = pieces[second]
            for first in sorted(fine) + list(range(links, second)):
                other = pieces[first]
                apart = other.joint != held.joint and other.name not in touched[held.name]
                if (
                    apart
                    and held.name not in touched.get(other.name, ())
                    and not self._may_touch(other.name, held.name)
                ):
                    yield first, second

    def _may_touch(self, first: str, second: str) -> bool:
        return frozenset((first, second)) in self._allowed

    def _margins(self) -> tuple[FloatArray, np.ndarray]:
        """Return the least distances (bodies, obstacles), m, and which (bodies, obstacles), bool, single pairs have.

        What does not move is not held against what stands still.
        """
        margins = np.full((len(self.bodies.pieces), len(self.obstacles.all)), -np.inf)
        of_pairs = np.zeros(margins.shape, dtype=bool)
        own = {thing.id: thing.margin for thing in self.scene.attached}
        of_obstacles = np.array([self.scene.margin if o.margin is None else o.margin for o in self.obstacles.all])
        by_name: dict[str, list[int]] = {}
        for number, obstacle in enumerate(self.obstacles.all):
            by_name.setdefault(obstacle.name, []).append(number)
        for number, body in enumerate(self.bodies.pieces):
            if not body.joint:
                continue
            margin = own.get(body.name)
            margins[number] = of_obstacles if margin is None else np.maximum(of_obstacles, margin)
            for pair in self._allowed:
                for other in pair - {body.name} if body.name in pair else ():
                    margins[number, by_name.get(other, [])] = -np.inf
            for moving, standing, least in self.scene.pair_margins:
                if moving == body.name:
                    among = by_name.get(standing, [])
                    margins[number, among] = np.minimum(margins[number, among], least)
                    of_pairs[number, among] = True
        return margins, of_pairs


def _least(numbers: FloatArray, most: int) -> np.ndarray:
    """Return the rows of the least of numbers (n,), in the order in which they are."""
    return np.sort(np.argpartition(numbers, most)[:most]) if len(numbers) > most else np.arange(len(numbers))


@lru_cache(maxsize=MOST_KEPT)
def checker_of(robot: Robot, scene: Scene | None, self_collision: bool | None) -> CollisionChecker:
    """Return the checker of a robot in a scene, the very same objects, prepared when it is first asked for."""
    return CollisionChecker(robot, scene, self_collision=self_collision)


def _bodies_of(robot: Robot, thing: AttachedObject) -> Sequence[Body]:
    """Return the pieces of an attached object in the frame of the joint that carries it."""
    frame = robot.model.frames[robot.tool_frame_id if thing.link is None else robot.model.getFrameId(thing.link)]
    turn = np.eye(3) if thing.pose.rotation is None else thing.pose.rotation
    rotation = frame.placement.rotation @ turn
    translation = frame.placement.rotation @ thing.pose.position + frame.placement.translation
    return [Body(thing.id, int(frame.parentJoint), rotation, translation, shape) for shape in thing.shapes]
