"""A robot among objects: the pairs of pieces to check, and cheap lower bounds of all their distances."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from planner.kernels.clearance import Distances, Measured
from planner.robots import Robot
from planner.scene.arrays import piece_arrays
from planner.scene.bodies import Bodies, Body, JointTree, Placements
from planner.scene.obstacles import Obstacles
from planner.scene.point_cloud import Cluster
from planner.scene.scene import AttachedObject, Scene, SceneObject, refuse_faults
from planner.scene.separations import Placed, Separation, cluster_separation, separation
from planner.spatial import FloatArray

CONTACT_TOLERANCE = 1e-5
"""Distance, m, by which a pair may be below its margin and still keep it.

Touching counts as free up to rounding, and GJK's plane proves distances of curved shapes to some micrometres.
"""

ITSELF = 0
"""Number of the pairs between pieces that move."""

AMONG_OBJECTS = 1
"""Number of the pairs of a piece that moves and one that stands still."""

CONTACTS = 2
"""Number of those among them that have a least distance of their own, since they may touch: `Scene.pair_margins`."""

KEPT_CHECKERS = 16
"""Number of checkers that a process keeps: remedies are tried, and edges planned, with the same few."""


class NearItems(NamedTuple):
    """Pairs of pieces that may be near each other at joint positions, one a row.

    Attributes:
        rows: (n,): number of the joint positions.
        pairs: (n,): number of the pair.
        bounds: (n,), m: the pair is no nearer there.
        motions: (n,), m: largest decrease of the distance within the given neighbourhood.
    """

    rows: np.ndarray
    pairs: np.ndarray
    bounds: FloatArray
    motions: FloatArray


class CollisionChecker:
    """A robot with its carried objects, among obstacles.

    Pairs have numbers: first the pairs of moving pieces, then every moving piece with every obstacle.

    Examples:
        >>> import planner
        >>> floor = planner.SceneObject("floor", [planner.HalfSpace([0.0, 0.0, 1.0], -0.05)])
        >>> checker = planner.CollisionChecker(planner.load_robot("kuka_kr16_2"), planner.Scene([floor]))
        >>> checker.is_empty
        False

    Attributes:
        base: The mounting of the robot, the base of its `JointTree`; None: that is the world.
        bodies: The pieces that move with the joints.
        obstacles: The pieces that stand still.
        moving: The objects that move by themselves. No pair has a piece of theirs: see
            `planner.certificate.moving_objects`.
        displacements: (bodies,), m: by following errors.
        first: (own pairs,): number of the body that moves less, of each pair of bodies.
        second: (own pairs,): number of the other one.
        margins: (bodies, obstacles), m: the margin; negative infinity without one. It contains the displacement of the
            body by following errors.
        own_margins: (own pairs,), m: the displacements of these bodies relative to each other by following errors.
        requested: For each kind of pairs with obstacles, its number, and a mask (bodies, obstacles) of its pairs.
    """

    def __init__(self, robot: Robot, scene: Scene | None = None, *, self_collision: bool | None = None) -> None:
        """Prepare the checks.

        Args:
            robot: The arm, with its tool and mounting.
            scene: The obstacles; None: none.
            self_collision: Whether the arm is checked against itself and its carried objects. None: with all shapes
                except coarse ones, capsules along its kinematics. Objects on a positioner are checked anyway.

        Raises:
            InvalidProblem: The scene names a link that there is not, or uses a name twice.
        """
        self.scene = scene or Scene()
        self.dof = robot.dof
        refuse_faults(robot, self.scene)
        shapes = robot.collision_shapes
        links = [Body.on(robot, shape.link, shape.joint, shape.placement, shape.shape) for shape in shapes]
        carried = [body for thing in self.scene.attached for body in _bodies_of(robot, thing)]
        self.bodies = Bodies(JointTree.of(robot), [*links, *carried])
        self.base = robot.mounting
        self.moving = self.scene.moving
        static = self.scene.objects
        if self.moving:
            static = tuple(thing for thing in static if thing not in self.moving)
        self.obstacles = Obstacles(static, robot.mounting)
        self._allowed = {frozenset(pair) for pair in self.scene.allowed_pairs}
        fine = {k for k, shape in enumerate(shapes) if self_collision or not shape.is_coarse}
        self._on_positioner = range(1, 1 + len(robot.positioner)) if robot.external_axes else range(0)
        found = self._own_pairs(robot, len(links), fine)
        pairs = [pair for pair in found if self_collision is not False or self._are_across(*pair)]
        self.first, self.second = np.array(pairs, dtype=int).reshape(-1, 2).T
        self._uncertainties = np.zeros(len(self.bodies.pieces))
        self._uncertainties[: len(shapes)] = [shape.uncertainty for shape in shapes]
        self.margins, self._may_be_near = self._margins()
        self.own_margins = np.array([self._own_margin(*pair) for pair in pairs])
        self.displacements = np.zeros(len(self.bodies.pieces))
        if robot.following_errors is not None:
            self._widen_margins(robot)
        requested = np.isfinite(self.margins)
        by_kind = {AMONG_OBJECTS: requested & ~self._may_be_near, CONTACTS: requested & self._may_be_near}
        self.requested = {kind: pairs for kind, pairs in by_kind.items() if pairs.any()}

    @property
    def own_pairs(self) -> int:
        """The number of pairs of pieces that move."""
        return len(self.first)

    @property
    def is_empty(self) -> bool:
        """Whether there is no pair to check."""
        return not self.own_pairs and not self.requested

    def kinds(self, pairs: np.ndarray) -> np.ndarray:
        """Return `ITSELF`, `AMONG_OBJECTS` or `CONTACTS` of pairs (n,)."""
        kinds = np.full(len(pairs), ITSELF)
        among = pairs >= self.own_pairs
        kinds[among] = np.where(self._may_be_near.ravel()[pairs[among] - self.own_pairs], CONTACTS, AMONG_OBJECTS)
        return kinds

    def uncertainty(self, kind: int) -> float:
        """Return the largest distance of the machine outside a kind of pairs' shapes, m; 0: none is estimated."""
        if kind == ITSELF:
            return float((self._uncertainties[self.first] + self._uncertainties[self.second]).max(initial=0.0))
        pairs = self.requested.get(kind)
        return 0.0 if pairs is None else float(self._uncertainties[pairs.any(axis=1)].max(initial=0.0))

    @property
    def largest_uncertainty(self) -> float:
        """The largest distance of the machine outside its estimated shapes, m; 0: none is estimated."""
        return float(self._uncertainties.max(initial=0.0))

    def names(self, pair: int) -> tuple[str, str]:
        """Return the names of a pair."""
        if pair < self.own_pairs:
            numbers = int(self.first[pair]), int(self.second[pair])
            return self.bodies.pieces[numbers[0]].name, self.bodies.pieces[numbers[1]].name
        body, obstacle = divmod(pair - self.own_pairs, len(self.obstacles.all))
        return self.bodies.pieces[body].name, self.obstacles.all[obstacle].name

    def margins_of(self, pairs: np.ndarray) -> FloatArray:
        """Return the margins of pairs (n,), m."""
        margins, among = np.empty(len(pairs)), pairs >= self.own_pairs
        margins[~among] = self.own_margins[pairs[~among]]
        margins[among] = self.margins.ravel()[pairs[among] - self.own_pairs]
        return margins

    @cached_property
    def distances(self) -> Distances:
        """The kernels of its distances."""
        kinds = np.where(self._may_be_near, CONTACTS, AMONG_OBJECTS)
        own = np.array([self.first, self.second])
        arrays = piece_arrays(self.bodies, self.obstacles, own, self.own_margins, self.margins, kinds)
        return Distances(arrays, self._measured)

    def near_items(self, positions: FloatArray, excursions: FloatArray, margins: FloatArray, own: float) -> NearItems:
        """Find the pairs that cheap bounds leave nearer than margins.

        Args:
            positions: (N, joints), rad or m.
            excursions: (N, joints), largest excursions of the joints from there, rad or m.
            margins: (bodies, obstacles), m; negative infinity: a pair does not count.
            own: The same of all pairs of bodies.
        """
        of_groups = self.obstacles.group_margins(margins)
        return NearItems(*self.distances.near_pairs(positions, excursions, own, margins, of_groups))

    def numbers_of(self, pairs: np.ndarray) -> np.ndarray:
        """Return the numbers of the two pieces of pairs (n, 2): bodies first, and then obstacles."""
        numbers = np.empty((len(pairs), 2), dtype=int)
        own = pairs < self.own_pairs
        numbers[own, 0], numbers[own, 1] = self.first[pairs[own]], self.second[pairs[own]]
        body, obstacle = np.divmod(pairs[~own] - self.own_pairs, max(len(self.obstacles.all), 1))
        numbers[~own, 0], numbers[~own, 1] = body, obstacle + len(self.bodies.pieces)
        return numbers

    def separate(self, placements: Placements, row: int, pair: int) -> Separation:
        """Compute the proved distance of a pair at one joint position."""
        return self._separation(placements.rotations[row], placements.origins[row], pair)

    def _separation(self, rotations: FloatArray, origins: FloatArray, pair: int) -> Separation:
        if pair < self.own_pairs:
            first, second = (self._placed(rotations, origins, int(body[pair])) for body in (self.first, self.second))
            return separation(first, second)
        body, number = divmod(pair - self.own_pairs, len(self.obstacles.all))
        obstacle, placed = self.obstacles.all[number], self._placed(rotations, origins, body)
        if isinstance(obstacle.shape, Cluster):
            return cluster_separation(placed, self.obstacles.balls(number))
        return separation(placed, Placed(obstacle.shape, obstacle.rotation, obstacle.translation))

    def _measured(self, rotations: FloatArray, origins: FloatArray, pair: int) -> Measured:
        apart = self._separation(rotations, origins, pair)
        return Measured(apart.proved, apart.distance, apart.normal)

    def _placed(self, rotations: FloatArray, origins: FloatArray, body: int) -> Placed:
        piece = self.bodies.pieces[body]
        rotation, origin = rotations[piece.joint], origins[piece.joint]
        return Placed(piece.shape, rotation @ piece.rotation, rotation @ piece.translation + origin)

    def _own_pairs(self, robot: Robot, links: int, fine: set[int]) -> Iterator[tuple[int, int]]:
        """Yield the pairs of bodies to check: the robot's own, then pairs with its carried objects.

        What an object is attached to may touch it, and so may another object that is attached there. Objects on a
        positioner are checked against coarse shapes, too.

        Args:
            robot: The arm.
            links: The number of its own pieces, which come first.
            fine: The numbers of the shapes that count.
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
            own = range(links) if held.joint in self._on_positioner else sorted(fine)
            for first in [*own, *range(links, second)]:
                other = pieces[first]
                apart = other.joint != held.joint and other.name not in touched[held.name]
                if (
                    apart
                    and held.name not in touched.get(other.name, ())
                    and not self._may_touch(other.name, held.name)
                ):
                    yield first, second

    def _are_across(self, first: int, second: int) -> bool:
        """Tell whether one of two bodies moves with a positioner, and the other one does not."""
        moved = (self.bodies.pieces[number].joint in self._on_positioner for number in (first, second))
        return len(set(moved)) == 2

    def _own_margin(self, first: int, second: int) -> float:
        """Return the margin of two bodies that move, m: objects on a positioner are surroundings of the arm."""
        if not self._are_across(first, second):
            return 0.0
        names = {self.bodies.pieces[number].name for number in (first, second)}
        own = [thing.margin for thing in self.scene.attached if thing.id in names]
        return max([margin for margin in own if margin is not None] or [self.scene.margin])

    def bodies_of_robot(self, given: Sequence[SceneObject]) -> Bodies:
        """Return the bodies of the robot, with the solids that it put down: objects that are not `given`."""
        put_down = {thing.id for thing in self.scene.objects if not any(thing is other for other in given)}
        own = [
            Body(piece.name, 0, piece.rotation, piece.translation, piece.shape)
            for piece in self.obstacles.pieces
            if piece.name in put_down and not isinstance(piece.shape, Cluster)
        ]
        return Bodies(self.bodies.tree, [*self.bodies.pieces, *own])

    def margin_to(self, name: str, other: SceneObject) -> float | None:
        """Return the margin of a link or a carried object to an object, m; None: they may touch."""
        if self._may_touch(name, other.id):
            return None
        held = next((thing.margin for thing in self.scene.attached if thing.id == name), None)
        margin = max(self.scene.margin if other.margin is None else other.margin, held or 0.0)
        return min([margin, *self._least_distances(name, other.id)])

    def is_contact(self, name: str, other: SceneObject) -> bool:
        """Tell whether a link or a carried object may be nearer to an object than its margin."""
        return any(True for _ in self._least_distances(name, other.id))

    def _least_distances(self, name: str, other: str) -> Iterator[float]:
        return (least for moving, standing, least in self.scene.pair_margins if (moving, standing) == (name, other))

    def _may_touch(self, first: str, second: str) -> bool:
        return frozenset((first, second)) in self._allowed

    def _margins(self) -> tuple[FloatArray, np.ndarray]:
        """Return the margins (bodies, obstacles), m, and a mask (bodies, obstacles) of pairs with their own margin.

        A body that does not move is not checked against static objects.
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

    def _widen_margins(self, robot: Robot) -> None:
        """Add the displacements by following errors to the margins, except of pairs that may touch."""
        moved = displacements_by_following(self.bodies, robot)
        self.displacements = moved.sum(axis=1)
        self.margins += np.where(self._may_be_near, 0.0, self.displacements[:, None])
        once = self.bodies.is_moved[self.first] != self.bodies.is_moved[self.second]
        self.own_margins = np.where(once, moved[self.first] + moved[self.second], 0.0).sum(axis=1)


@lru_cache(maxsize=KEPT_CHECKERS)
def checker_of(robot: Robot, scene: Scene | None, self_collision: bool | None) -> CollisionChecker:
    """Return the checker of a robot in a scene, from a cache for the same objects."""
    return CollisionChecker(robot, scene, self_collision=self_collision)


def displacements_by_following(bodies: Bodies, robot: Robot) -> FloatArray:
    """Bound the displacements (bodies, joints), m, of a robot's bodies by its following errors."""
    farthest = np.abs([robot.limit("lower"), robot.limit("upper")]).max(axis=0)
    return bodies.displacements_by(np.array([joint.following_error for joint in robot.joints]), farthest)


def _bodies_of(robot: Robot, thing: AttachedObject) -> Sequence[Body]:
    """Return the pieces of an attached object in the frame of the joint that carries it."""
    frame = robot.model.frames[robot.tool_frame_id if thing.link is None else robot.model.getFrameId(thing.link)]
    turn = np.eye(3) if thing.pose.rotation is None else thing.pose.rotation
    rotation = frame.placement.rotation @ turn
    translation = frame.placement.rotation @ thing.pose.position + frame.placement.translation
    placement = pin.SE3(rotation, translation)
    return [Body.on(robot, thing.id, int(frame.parentJoint), placement, shape) for shape in thing.shapes]
