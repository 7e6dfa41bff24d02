"""A roadmap is built, extended, and proved again where its scene changes, by one function.

The nodes are the collision-free ones among the given joint positions, the corners of short paths between these, and a
fixed sequence of samples. The edges are the proved ones among the motions of each node to its nearest others, and the
motions of these paths. Motions of an earlier roadmap are proved again against changed objects only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import ArrayLike

from planner.errors import InvalidProblem
from planner.free_motion.free_path import find_free_path
from planner.free_motion.roadmaps.digests import digests_of, sampled_range
from planner.roadmap import MOST_ROADMAP_POSITIONS, MOST_ROADMAP_SAMPLES, Roadmap
from planner.robots import Robot
from planner.scene import CONTACT_TOLERANCE, Budget, CollisionChecker, Scene, clearances, edge
from planner.scene.carried import without_objects
from planner.scene.checker import checker_of
from planner.spatial import FloatArray

NEIGHBOURS = 8
"""Number of nearest nodes to which a node is joined, if the motions are free."""

DEFAULT_SAMPLES = 600
"""Number of samples of a roadmap by default."""

EDGE_BUDGET = Budget(400, 400)
"""Limits on the proof of an edge, ten times the usual work. A motion so close to an object is unsuitable anyway."""

GOLDEN_STEPS = 60
"""Number of steps after which the base of the sequence of samples no longer changes."""

MOST_WAYS = 66
"""Largest number of pairs of given positions, the nearest first, between which short paths are searched."""

MOST_WAY_CHECKS = 2000
"""Largest number of motions that the search for such a path checks."""


class _Surroundings:
    """A robot among objects: tells which joint positions and motions are free, and counts the checks."""

    def __init__(self, checker: CollisionChecker) -> None:
        self.checker = checker
        self.checked = 0

    def is_free(self, position: FloatArray) -> bool:
        """Tell whether a joint position (joints,) seems free; the proofs of its edges prove it."""
        self.checked += 1
        return self.checker.distances.first_collision(position[None], CONTACT_TOLERANCE) is None

    def is_free_between(self, start: FloatArray, end: FloatArray) -> bool:
        """Prove that the straight motion between two joint positions (joints,) keeps all margins."""
        self.checked += 1
        return clearances(self.checker, edge(start, end), budget=EDGE_BUDGET).is_proved


@dataclass(frozen=True)
class _Known:
    """The results of an earlier roadmap of the same robot that still count.

    Attributes:
        nodes: Its joint positions, as bytes.
        blocked: The joint positions known not to be free, as bytes.
        edges: Its edges, as pairs of joint positions.
        unproved: The motions known to have no proof.
        ways: Its short paths (positions, joints) between given positions, by their ends.
        changed: The robot among the objects that have come or changed since; None: there are none.
    """

    nodes: frozenset[bytes] = frozenset()
    blocked: frozenset[bytes] = frozenset()
    edges: frozenset[tuple[bytes, bytes]] = frozenset()
    unproved: frozenset[tuple[bytes, bytes]] = frozenset()
    ways: Mapping[tuple[bytes, bytes], FloatArray] = field(default_factory=dict)
    changed: _Surroundings | None = None


def build_roadmap(
    robot: Robot,
    scene: Scene,
    *,
    samples: int = DEFAULT_SAMPLES,
    positions: ArrayLike = (),
    self_collision: bool | None = None,
    earlier: Roadmap | None = None,
) -> Roadmap:
    """Build a roadmap of a robot in a scene.

    Equal arguments give equal roadmaps. Plans with a roadmap are certified like all others.

    Args:
        robot: The arm, with its tool and mounting.
        scene: The obstacles and attached objects.
        samples: Number of sampled joint positions, at most `MOST_ROADMAP_SAMPLES`; collision-free ones become nodes.
        positions: (positions, joints), rad or m, at most `MOST_ROADMAP_POSITIONS`: joint positions besides the samples.
        self_collision: See `CollisionChecker`.
        earlier: A roadmap of the robot in an earlier state of the scene. Its nodes and edges are checked again only
            against objects that have come or changed since. Blocked positions and motions are tried again only if an
            object has gone or changed.

    Raises:
        InvalidProblem: The scene names an unknown link; a position or the number of samples is invalid.

    Examples:
        >>> import planner
        >>> robot = planner.load_robot("kuka_kr16_2")
        >>> wall = planner.SceneObject("wall", [planner.Box([0.8, 0.1, 1.6])], planner.Pose([1.3, 0.0, 0.8]))
        >>> roadmap = planner.build_roadmap(robot, planner.Scene([wall]), samples=20)
        >>> changed = planner.build_roadmap(robot, planner.Scene([]), samples=20, earlier=roadmap)
        >>> len(changed.positions) >= len(roadmap.positions)
        True
    """
    given = _checked(robot, samples, positions)
    checker = checker_of(robot, scene, self_collision)
    lower, upper = sampled_range(robot)
    of_robot, objects = digests_of(robot, checker)
    known = _Known()
    if earlier is not None and earlier.robot == of_robot:
        known = _known(earlier, robot, scene, objects, _samples(lower, upper, earlier.samples))
    around = _Surroundings(checker)
    ways = _ways(robot, given, known, around)
    corners = [row for way in ways for row in way]
    rows = np.concatenate([given, np.reshape(corners, (-1, robot.dof)), _samples(lower, upper, samples)])
    rows = rows[np.sort(np.unique(rows, axis=0, return_index=True)[1])]
    nodes = rows[[_is_node(row, known, around) for row in rows]]
    numbers = {_key(row): number for number, row in enumerate(nodes)}
    of_ways = tuple(tuple(numbers[_key(row)] for row in way) for way in ways)
    legs = {(leg[0], leg[1]) for way in of_ways for leg in map(sorted, pairwise(way))}
    pairs = [(first, second) for first, second in neighbours(nodes).tolist() if (first, second) not in legs]
    proved = [pair for pair in pairs if _is_edge(nodes[list(pair)], known, around)]
    edges = np.array(sorted(legs.union(proved)), dtype=int).reshape(-1, 2)
    checked = around.checked + (0 if known.changed is None else known.changed.checked)
    return Roadmap(nodes, edges, samples, given, of_ways, of_robot, objects, checked)


def _ways(robot: Robot, given: FloatArray, known: _Known, around: _Surroundings) -> list[FloatArray]:
    """Return short proved paths (positions, joints) between the given joint positions, known ones where they hold."""
    free = [row for row in given if _is_node(row, known, around)]
    lengths = {(i, j): float(np.linalg.norm(free[j] - free[i])) for i, j in combinations(range(len(free)), 2)}
    ends = sorted(lengths, key=lengths.__getitem__)
    ways = []
    for first, second in ends[:MOST_WAYS]:
        way = known.ways.get((_key(free[first]), _key(free[second])))
        if way is None or not all(_is_edge(leg, known, around) for leg in _legs(way)):
            found = find_free_path(robot, around.checker, free[first], free[second][None], most_checks=MOST_WAY_CHECKS)
            around.checked += found.checks
            way = found.positions if found.status == "found" else None
        if way is not None:
            ways.append(way)
    return ways


def _legs(way: FloatArray) -> FloatArray:
    """Return the motions (motions, 2, joints) of a path (positions, joints)."""
    legs: FloatArray = np.stack([way[:-1], way[1:]], axis=1)
    return legs


def neighbours(positions: FloatArray) -> np.ndarray:
    """Return the pairs (pairs, 2) of each joint position (N, joints) and its nearest others, the lower number first."""
    from scipy.spatial import cKDTree  # here only: most processes never need it

    count = min(NEIGHBOURS + 1, len(positions))
    if count < 2:
        return np.empty((0, 2), dtype=int)
    _, near = cKDTree(positions).query(positions, k=count)
    first = np.repeat(np.arange(len(positions)), count)
    pairs = np.sort(np.column_stack([first, near.ravel()]), axis=1)
    return np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0)


def _checked(robot: Robot, samples: int, positions: ArrayLike) -> FloatArray:
    """Check the number of samples, and return the given joint positions (given, joints).

    Raises:
        InvalidProblem: One of them is invalid.
    """
    if not 0 <= samples <= MOST_ROADMAP_SAMPLES:
        raise InvalidProblem([(("samples",), f"must be from 0 to {MOST_ROADMAP_SAMPLES}; got {samples}")])
    given = np.asarray(positions, dtype=np.float64)
    given = given.reshape(-1, robot.dof) if given.size == 0 else given
    if given.ndim != 2 or given.shape[1] != robot.dof or not np.isfinite(given).all():
        message = f"must be rows of {robot.dof} finite numbers, one for each joint"
        raise InvalidProblem([(("positions",), message)])
    if len(given) > MOST_ROADMAP_POSITIONS:
        raise InvalidProblem(
            [(("positions",), f"must be at most {MOST_ROADMAP_POSITIONS} joint positions; got {len(given)}")]
        )
    lower, upper = robot.limit("lower"), robot.limit("upper")
    beyond = np.argwhere((given < lower) | (given > upper))
    if len(beyond):
        faults = [
            (("positions", row, joint), f"must be from {lower[joint]:g} to {upper[joint]:g}; got {given[row, joint]:g}")
            for row, joint in beyond.tolist()
        ]
        raise InvalidProblem(faults)
    return given


def _samples(lower: FloatArray, upper: FloatArray, count: int) -> FloatArray:
    """Return the first samples (count, joints) of a sequence that fills a box evenly.

    It is the additive recurrence of M. Roberts, The unreasonable effectiveness of quasirandom sequences, 2018.
    """
    joints, base = len(lower), 2.0
    for _ in range(GOLDEN_STEPS):
        base = (1.0 + base) ** (1.0 / (joints + 1))
    steps = base ** -np.arange(1.0, joints + 1.0)
    shares = np.mod(0.5 + np.arange(1.0, count + 1.0)[:, None] * steps, 1.0)
    found: FloatArray = lower + shares * (upper - lower)
    return found


def _known(earlier: Roadmap, robot: Robot, scene: Scene, objects: Mapping[str, str], samples: FloatArray) -> _Known:
    """Return what an earlier roadmap of the same robot, with its samples (samples, joints), tells about a scene."""
    same = {name for name, digest in objects.items() if earlier.objects.get(name) == digest}
    nodes = frozenset(map(_key, earlier.positions))
    edges = frozenset(map(_motion, earlier.positions[earlier.edges]))
    blocked, unproved = frozenset[bytes](), frozenset[tuple[bytes, bytes]]()
    if len(same) == len(earlier.objects):
        tried = earlier.positions[neighbours(earlier.positions)]
        blocked = frozenset(map(_key, [*earlier.given, *samples])) - nodes
        unproved = frozenset(map(_motion, tried)) - edges
    changed = None
    if len(same) < len(objects):
        among = without_objects(scene, frozenset(same))
        changed = _Surroundings(CollisionChecker(robot, among, self_collision=False))
    ways = {(_key(way[0]), _key(way[-1])): way for way in (earlier.positions[list(each)] for each in earlier.ways)}
    return _Known(nodes, blocked, edges, unproved, ways, changed)


def _is_node(position: FloatArray, known: _Known, around: _Surroundings) -> bool:
    """Tell whether a joint position (joints,) is free."""
    key = _key(position)
    if key in known.nodes:
        return known.changed is None or known.changed.is_free(position)
    return key not in known.blocked and around.is_free(position)


def _is_edge(ends: FloatArray, known: _Known, around: _Surroundings) -> bool:
    """Tell whether the motion between two joint positions (2, joints) is proved free."""
    key = _motion(ends)
    if key in known.edges:
        return known.changed is None or known.changed.is_free_between(*ends)
    return key not in known.unproved and around.is_free_between(*ends)


def _motion(ends: FloatArray) -> tuple[bytes, bytes]:
    """Return the key of a motion between two joint positions (2, joints), in either direction."""
    start, end = sorted(map(_key, ends))
    return start, end


def _key(position: FloatArray) -> bytes:
    return position.tobytes()
