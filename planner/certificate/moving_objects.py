"""The proof that a trajectory keeps clear of objects that move on known trajectories, at all times.

The robot and an object that moves are one tree: the joints of the robot, and the joints along which the object slides
and turns. So the proof of one robot holds for both.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from planner.errors import ClearanceUnproved, Collision, StartInCollision
from planner.scene.between import CheckerBetween
from planner.scene.checker import CONTACT_TOLERANCE, ITSELF, CollisionChecker
from planner.scene.continuous import Clearances, Nearest, clearances, edge
from planner.scene.phases import Phase, object_phases, side_by_side
from planner.scene.scene import SceneObject
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import Trajectory

SAMPLES_BEFORE_CONTACT = 256
"""Number of times at which a pair that is too near is looked at to tell when it first is."""

CONTACT_TIME_HALVINGS = 30
"""Number of halvings of the time of first contact: to a billionth of a step between two samples."""


class Meeting(NamedTuple):
    """A robot and an object that moves at constant velocities, in an interval of time.

    Attributes:
        checker: The pairs of both.
        phase: The object.
        begin: When the interval begins, s.
        end: When it ends, s.
        are_contacts: Whether the pairs may be nearer than their margin, since the object is taken.
    """

    checker: CheckerBetween
    phase: Phase
    begin: float
    end: float
    are_contacts: bool

    def motion(self, part: Trajectory, start: float) -> PiecewisePolynomial:
        """Return the motion of all joints in the interval; the part of the trajectory begins at `start`, s."""
        own = part.between(self.begin - start, min(self.end - start, part.duration))
        return side_by_side(own, self.phase.between(self.begin, self.end))


def clearances_of_objects(
    checker: CollisionChecker,
    given: Sequence[SceneObject],
    part: Trajectory,
    begin: float,
    tolerance: float | None,
) -> Iterator[tuple[Meeting, Clearances]]:
    """Prove the margins to each object that moves, and yield the clearances; times start at the meeting.

    Args:
        checker: The robot and its surroundings.
        given: The objects of the scene before the robot put any down.
        part: A part of the trajectory on which nothing changes.
        begin: When it begins, s.
        tolerance: How well the clearances are measured, m; None: only the margins are proved.

    Raises:
        StartInCollision: A margin is not kept where the trajectory begins.
        Collision: A margin is not kept later.
        ClearanceUnproved: It takes too long to prove.
    """
    for meeting in meetings(checker, given, begin, begin + part.duration):
        motion = meeting.motion(part, begin)
        found = clearances(meeting.checker, motion, tolerance=tolerance)
        if found.hit is not None:
            raise _collision(checker.dof, meeting, motion, part, begin, found.hit)
        if found.undecided is not None:
            pair, time = meeting.checker.names(found.undecided.pair), meeting.begin + found.undecided.time
            raise ClearanceUnproved(
                f"that {pair[0]} keeps {found.undecided.margin:g} m clear of {pair[1]}, which moves, near {time:.4g} s "
                f"could not be proved after {found.distances} distances: they come as near as that, or nearly so, "
                "for long",
                time=time,
                limit=found.undecided.margin,
                pair=pair,
            )
        if np.isfinite(found.lower[ITSELF]):
            yield meeting, found


def meetings(checker: CollisionChecker, given: Sequence[SceneObject], begin: float, end: float) -> Iterator[Meeting]:
    """Yield the meetings of a robot with each object that moves, from a time to another, s."""
    bodies = checker.bodies_of_robot(given)
    displacements = np.append(checker.displacements, np.zeros(len(bodies.pieces) - len(checker.bodies.pieces)))
    for thing in checker.moving:
        margins = np.array([checker.margin_to(piece.name, thing) for piece in bodies.pieces], dtype=np.float64)
        contacts = np.array([checker.is_contact(piece.name, thing) for piece in bodies.pieces])
        wanted = np.where(np.isnan(margins), -np.inf, margins + np.where(contacts, 0.0, displacements))
        for phase in object_phases(thing, checker.base, end):
            first, last = max(phase.begin, begin), min(phase.end, end)
            for of_kind in (~contacts, contacts):
                if first < last and of_kind.any():
                    pairs = np.repeat(np.where(of_kind, wanted, -np.inf)[:, None], len(phase.bodies.pieces), axis=1)
                    among = CheckerBetween(bodies, phase.bodies, pairs)
                    yield Meeting(among, phase, first, last, of_kind is contacts)


def _collision(
    joints: int, meeting: Meeting, motion: PiecewisePolynomial, part: Trajectory, begin: float, hit: Nearest
) -> Collision:
    """Build the refusal of a robot that comes too near to an object that moves, with the first time."""
    start = motion.evaluate(np.zeros(1), [0])[0][0]
    at_start = clearances(meeting.checker, edge(start, start)).hit if meeting.begin == 0.0 else None
    hit = hit if at_start is None else at_start._replace(time=0.0)
    pair = meeting.checker.names(hit.pair)
    nearness = (
        f"{pair[0]} would be {-hit.distance:.3g} m inside of {pair[1]}, which moves"
        if hit.distance <= 0.0
        else f"{pair[0]} would come within {hit.distance:.4g} m of {pair[1]}, which moves, "
        f"with a margin of {hit.margin:g} m"
    )
    time = meeting.begin if at_start is not None else meeting.begin + first_contact(meeting.checker, motion, hit)
    fields: dict[str, Any] = {
        "pair": pair,
        "depth": hit.missing,
        "point": hit.point if np.isfinite(hit.point).all() else None,
        "position": motion.evaluate(np.array([hit.time]), [0])[0][0, :joints],
        "time": time,
        "value": hit.distance,
        "limit": hit.margin,
    }
    if at_start is not None:
        return StartInCollision(f"where the robot starts, {nearness}", **fields, waypoint=0)
    segment = int(part.segments[part.locate(np.array([time - begin]))[0][0]])
    where = f"on the way from waypoint {{segment}} to {{segment_end}}, too near from {time:.4g} s on"
    return Collision(f"{nearness}, {where}", **fields, segment=segment)


def first_contact(checker: CollisionChecker, motion: PiecewisePolynomial, hit: Nearest) -> float:
    """Return the first sampled time, s, at which a pair is below its margin."""
    times = np.linspace(0.0, hit.time, SAMPLES_BEFORE_CONTACT)
    placements = checker.bodies.at(motion.evaluate(times, [0])[0])

    def is_near(distance: float) -> bool:
        return hit.margin - distance > CONTACT_TOLERANCE

    seen = (k for k in range(1, len(times)) if is_near(checker.separate(placements, k, hit.pair).distance))
    near = next(seen, len(times) - 1)  # rounding may put a pair on the other side of the tolerance there
    low, high = times[near - 1], times[near]
    for _ in range(CONTACT_TIME_HALVINGS):
        middle = (low + high) / 2.0
        placement = checker.bodies.at(motion.evaluate(np.array([middle]), [0])[0])
        if is_near(checker.separate(placement, 0, hit.pair).distance):
            high = middle
        else:
            low = middle
    return float(high)
