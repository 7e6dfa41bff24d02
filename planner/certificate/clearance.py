"""The proof that a trajectory keeps its clearance from the robot itself and from objects, at all times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from planner.certificate.moving_objects import clearances_of_objects, first_contact
from planner.errors import ClearanceUnproved, Collision, StartInCollision
from planner.problems.problem import PlanningProblem
from planner.problems.rides import handling_of
from planner.scene.carried import checkers_of_segments
from planner.scene.checker import AMONG_OBJECTS, CONTACTS, ITSELF, CollisionChecker, checker_of
from planner.scene.continuous import Clearances, Nearest, clearances, edge
from planner.scene.scene import SceneObject
from planner.shapes.meshes.mesh import distance_from_mesh
from planner.spatial import FloatArray
from planner.trajectories.trajectory import PlanWarning, Trajectory

CLEARANCE_TOLERANCE = 1e-3
"""Default accuracy of clearances, m: the measuring accuracy of cells."""


@dataclass(frozen=True)
class Clearance:
    """The smallest distance between two links or objects on a trajectory.

    Attributes:
        lower: m: proved at all times, rounding included, to be no more than what there is.
        upper: m: the least distance that was seen; None: it was not measured.
        time: When that was, s.
        pair: Names of the links or objects.
        method: How it is known; the bounds hold between all samples.
        shapes: `model`: all shapes of the links come from the robot's model; `estimate`: at least one is estimated.
        uncertainty: Largest distance of the machine's surface outside its estimated shapes, m.

    Examples:
        >>> import planner
        >>> planner.Clearance(0.0194, 0.0201, 1.25, ("link_5", "table")).method
        'certified'
    """

    lower: float
    upper: float | None
    time: float | None
    pair: tuple[str, str] | None
    method: Literal["certified"] = "certified"
    shapes: Literal["model", "estimate"] = "model"
    uncertainty: float = 0.0


@dataclass(frozen=True)
class ClearanceReport:
    """The clearances of a trajectory, which keeps every margin up to `planner.scene.CONTACT_TOLERANCE`.

    Attributes:
        itself: Between links of the arm and its carried objects; None: no such pairs are checked.
        scene: Between those and objects; None: none are. On motions on which a pair may touch, since something is taken
            or put down at their ends, that pair is left out.
        contacts: Between such pairs on such motions; None: there are none.

    Examples:
        >>> import planner
        >>> report = planner.ClearanceReport(None, planner.Clearance(0.0194, 0.0201, 1.25, ("link_5", "table")))
        >>> report.scene.pair
        ('link_5', 'table')
    """

    itself: Clearance | None
    scene: Clearance | None
    contacts: Clearance | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the report in plain values, ready for JSON."""
        return {name: None if part is None else vars(part) for name, part in vars(self).items()}

    def warnings(self) -> Iterator[PlanWarning]:
        """Yield a warning where estimated shapes are nearer than the machine may stick out of them."""
        parts = [part for part in (self.itself, self.scene, self.contacts) if part is not None]
        near = [part for part in parts if part.lower < part.uncertainty]
        if near:
            advised = max(part.uncertainty for part in near)
            message = f"the machine may stick out of its estimated shapes: a margin of {advised:.3g} m covers that"
            yield PlanWarning("estimated_shapes", message)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> ClearanceReport:
        """Read what `as_dict` wrote."""
        return cls(
            **{
                name: None if part is None else Clearance(**part | {"pair": part["pair"] and tuple(part["pair"])})
                for name, part in values.items()
            }
        )


def certify_clearance(
    checker: CollisionChecker, trajectory: Trajectory, tolerance: float | None = CLEARANCE_TOLERANCE
) -> ClearanceReport | None:
    """Prove that a trajectory keeps every margin; None: there is no pair to check.

    Args:
        checker: The robot and its obstacles.
        trajectory: A trajectory from any source.
        tolerance: How well the clearances are measured, m; None: not at all, only the margins are proved.

    Raises:
        StartInCollision: A margin is not kept where the trajectory begins.
        Collision: A margin is not kept later.
        ClearanceUnproved: It takes too long to prove.
    """
    return certify_clearance_along((checker,), trajectory, tolerance)


def segment_checkers(problem: PlanningProblem, positions: FloatArray) -> tuple[CollisionChecker, ...]:
    """Return the collision checker of each segment, the same object where nothing changes."""
    if problem.scene is None:
        return (checker_of(problem.robot, None, problem.self_collision),) * max(1, len(positions) - 1)
    return checkers_of_segments(problem.robot, problem.scene, problem.self_collision, handling_of(problem), positions)


def certify_clearance_along(
    checkers: Sequence[CollisionChecker],
    trajectory: Trajectory,
    tolerance: float | None = CLEARANCE_TOLERANCE,
    given: Sequence[SceneObject] | None = None,
) -> ClearanceReport | None:
    """Prove that a trajectory keeps every margin while the carried objects change, and others move.

    Args:
        checkers: The robot and its obstacles on each segment; one: on all of them.
        trajectory: A trajectory from any source.
        tolerance: See `certify_clearance`.
        given: The objects of the scene before the robot takes or puts down any; None: the objects of the first segment.

    Raises:
        PlanningError: See `certify_clearance`; times, segments and waypoints refer to the whole.
    """
    report: ClearanceReport | None = None
    for checker, part, begin in parts_of(checkers, trajectory):
        if not checker.is_empty:
            report = _nearer(report, _later(_certified_part(checker, part, begin, tolerance), begin))
        if checker.moving:
            objects = checkers[0].scene.objects if given is None else given
            for meeting, found in clearances_of_objects(checker, objects, part, begin, tolerance):
                near = report_of(meeting.checker, found, checker.largest_uncertainty).itself
                parts = (None, near) if meeting.are_contacts else (near, None)
                report = _nearer(report, _later(ClearanceReport(None, *parts), meeting.begin))
    return report


def _certified_part(
    checker: CollisionChecker, part: Trajectory, begin: float, tolerance: float | None
) -> ClearanceReport:
    """Prove that a part of a trajectory keeps every margin; times of the result start at the part.

    Raises:
        PlanningError: See `certify_clearance`; times refer to the whole.
    """
    found = clearances(checker, part, tolerance=tolerance)
    if found.hit is not None:
        raise _collision(checker, part, begin, found.hit)
    if found.undecided is not None:
        first, second = checker.names(found.undecided.pair)
        time = begin + found.undecided.time
        (there,) = part.evaluate(np.array([found.undecided.time]), [0])
        raise ClearanceUnproved(
            f"that {first} keeps {found.undecided.margin:g} m clear of {second} near {time:.4g} s "
            f"could not be proved after {found.distances} distances: they come as near as that, or nearly so, for long"
            + _coarseness(checker, found.undecided, there[0]),
            time=time,
            limit=found.undecided.margin,
            pair=(first, second),
        )
    return report_of(checker, found)


def parts_of(
    checkers: Sequence[CollisionChecker], trajectory: Trajectory
) -> Iterator[tuple[CollisionChecker, Trajectory, float]]:
    """Yield the parts of a trajectory on which nothing changes, each with the time at which it begins, s."""
    numbers = np.minimum(trajectory.segments, len(checkers) - 1)
    changes = [k for k in range(1, len(numbers)) if checkers[numbers[k]] is not checkers[numbers[k - 1]]]
    for first, last in pairwise([0, *changes, len(numbers)]):
        part = trajectory
        if changes:
            lengths = trajectory.lengths[first:last]
            ends = np.array([0.0, lengths.sum()])
            pieces = trajectory.coefficients[first:last], trajectory.segments[first:last]
            part = Trajectory(lengths, *pieces, ends, ends)
        yield checkers[numbers[first]], part, float(trajectory.breakpoints[first])


def _later(report: ClearanceReport, begin: float) -> ClearanceReport:
    """Return the clearances of a part that begins at a time, s."""

    def later(part: Clearance | None) -> Clearance | None:
        return part if part is None or part.time is None else replace(part, time=part.time + begin)

    return ClearanceReport(later(report.itself), later(report.scene), later(report.contacts))


def _nearer(one: ClearanceReport | None, other: ClearanceReport | None) -> ClearanceReport | None:
    """Return the clearances of two parts together."""
    if one is None or other is None:
        return one or other
    names = (field.name for field in fields(ClearanceReport))
    return ClearanceReport(*(_nearer_of(getattr(one, name), getattr(other, name)) for name in names))


def _nearer_of(one: Clearance | None, other: Clearance | None) -> Clearance | None:
    if one is None or other is None:
        return one or other
    nearest = one if other.upper is None or (one.upper is not None and one.upper <= other.upper) else other
    vaguest = max(one, other, key=lambda part: part.uncertainty)
    shapes, uncertainty = vaguest.shapes, vaguest.uncertainty
    return replace(nearest, lower=min(one.lower, other.lower), shapes=shapes, uncertainty=uncertainty)


def report_of(checker: CollisionChecker, found: Clearances, least_uncertainty: float = 0.0) -> ClearanceReport:
    """Build the report of the clearances of each kind of pairs, with at least an uncertainty, m."""

    def part(kind: int) -> Clearance | None:
        near, lower = found.nearest[kind], float(found.lower[kind])
        if not np.isfinite(lower):
            return None
        uncertainty = max(checker.uncertainty(kind), least_uncertainty)
        found_part = Clearance(
            lower, None, None, None, "certified", "estimate" if uncertainty else "model", uncertainty
        )
        if near is None:
            return found_part
        return replace(found_part, upper=near.distance, time=near.time, pair=checker.names(near.pair))

    return ClearanceReport(part(ITSELF), part(AMONG_OBJECTS), part(CONTACTS))


def _collision(checker: CollisionChecker, part: Trajectory, begin: float, hit: Nearest) -> Collision:
    """Build the refusal of a part of a trajectory with a pair below its margin, with the first time."""
    (start,) = part.evaluate(np.zeros(1), [0])
    at_start = clearances(checker, edge(start[0], start[0])).hit
    if at_start is not None:
        nearness, known = _nearness(checker, at_start, start[0]), _fields(checker, at_start, start[0], begin)
        if begin == 0.0:
            return StartInCollision(f"where the robot starts, {nearness}", **known, waypoint=0)
        waypoint = int(part.segments[0])
        message = f"from waypoint {{waypoint}} on, {nearness}"
        return Collision(message, **known, segment=waypoint, waypoint=waypoint)
    time = first_contact(checker, part, hit)
    segment = int(part.segments[part.locate(np.array([time]))[0][0]])
    (there,) = part.evaluate(np.array([hit.time]), [0])
    nearness, when = _nearness(checker, hit, there[0]), begin + time
    message = f"on the way from waypoint {{segment}} to {{segment_end}}, {nearness}, too near from {when:.4g} s on"
    return Collision(message, **_fields(checker, hit, there[0], when), segment=segment)


def refuse_collision_at(checker: CollisionChecker, position: FloatArray, waypoint: int) -> None:
    """Refuse the joint position (joints,) of a waypoint if it does not keep a margin.

    Raises:
        StartInCollision: It is that of the first waypoint.
        Collision: It is that of another one.
    """
    hit = clearances(checker, edge(position, position)).hit
    if hit is not None:
        kind = StartInCollision if waypoint == 0 else Collision
        message = f"at waypoint {{waypoint}}, {_nearness(checker, hit, position)}"
        raise kind(message, **_fields(checker, hit, position, None), waypoint=waypoint)


def _nearness(checker: CollisionChecker, hit: Nearest, position: FloatArray) -> str:
    first, second = checker.names(hit.pair)
    coarse = _coarseness(checker, hit, position)
    if hit.distance <= 0.0:
        return f"{first} would be {-hit.distance:.3g} m inside of {second}{coarse}"
    return f"{first} would come within {hit.distance:.4g} m of {second}, with a margin of {hit.margin:g} m{coarse}"


def _coarseness(checker: CollisionChecker, near: Nearest, position: FloatArray) -> str:
    """Return what to add to a refusal where a mesh keeps its margin at joint positions (joints,), unlike its pieces."""
    if near.pair < checker.own_pairs:
        return ""
    body, number = checker.numbers_of(np.array([near.pair]))[0].tolist()
    piece, obstacle = checker.bodies.pieces[body], checker.obstacles.all[number - len(checker.bodies.pieces)]
    mesh = next((thing.mesh for thing in checker.scene.objects if thing.id == obstacle.name), None)
    if mesh is None:
        return ""
    placements = checker.bodies.at(position[None])
    turn = obstacle.rotation.T @ placements.rotations[0, piece.joint]
    origin = obstacle.rotation.T @ (placements.origins[0, piece.joint] - obstacle.translation)
    distance = distance_from_mesh(mesh, piece.shape, turn @ piece.rotation, turn @ piece.translation + origin)
    if distance <= near.margin:
        return ""
    return (
        f" (its mesh is {distance:.3g} m away there: the convex pieces of {obstacle.name} fill the room between; "
        "give it as several objects, each nearly convex)"
    )


def _fields(checker: CollisionChecker, hit: Nearest, position: FloatArray, time: float | None) -> dict[str, Any]:
    return {
        "pair": checker.names(hit.pair),
        "depth": hit.missing,
        "point": hit.point if np.isfinite(hit.point).all() else None,
        "position": position,
        "time": time,
        "value": hit.distance,
        "limit": hit.margin,
    }


def at_rest(position: FloatArray) -> Trajectory:
    """Return the trajectory that rests at a joint position (joints,) for a second."""
    ends = np.array([0.0, 1.0])
    return Trajectory(np.ones(1), position[None, :, None], np.zeros(1, dtype=int), ends, ends)
