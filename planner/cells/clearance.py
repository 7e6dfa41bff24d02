"""The proof that two movers keep clear of each other at all times, for every start skew of their controllers.

A start skew e shifts the second trajectory: time t of the first trajectory meets time t + e of the second one. For one
skew, both movers move together like one robot with the joints of both, and the proof of one robot holds. A range of
skews e - w to e + w is proved at its middle. There the margin of each pair is larger by the displacement of the second
mover's body in a time of w. Where that is too coarse, the interval of time or the range of skews is halved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from typing import Any, NamedTuple

import numpy as np

from planner.cells.movers import Mover, Phase, side_by_side
from planner.certificate.clearance import CLEARANCE_TOLERANCE, Clearance
from planner.errors import ClearanceUnproved, Collision, InvalidProblem, StartInCollision
from planner.scene.between import CheckerBetween
from planner.scene.checker import CONTACT_TOLERANCE, ITSELF
from planner.scene.continuous import Clearances, Nearest, clearances
from planner.spatial import FloatArray

MOST_PROOFS = 4000
"""The largest number of proofs of intervals and ranges of skews for one pair of movers."""

INTERVALS_PER_SKEW = 4.0
"""An interval of time longer than its range of skews by this factor is halved first."""


@dataclass(frozen=True)
class ClearanceBetween:
    """The proved clearance between two movers.

    Attributes:
        movers: The names of both.
        clearance: The clearance at all times and for every skew; its time is on the clock of the first mover. Names of
            the pair are `mover/link`. The least distance seen is that without a skew.
        skew: The largest start skew between both, s.
    """

    movers: tuple[str, str]
    clearance: Clearance
    skew: float

    def as_dict(self) -> dict[str, object]:
        """Return the check in plain values, ready for JSON."""
        return {"movers": self.movers, "clearance": vars(self.clearance), "skew": self.skew}


class Part(NamedTuple):
    """A pair of phases in an interval of time and a range of skews, s."""

    phases: tuple[Phase, Phase]
    checker: CheckerBetween
    begin: float
    end: float
    skew: float
    width: float

    def halves(self) -> tuple[Part, Part]:
        """Return both halves, of the interval or of the range of skews."""
        if self.end - self.begin > INTERVALS_PER_SKEW * self.width:
            middle = (self.begin + self.end) / 2.0
            return self._replace(end=middle), self._replace(begin=middle)
        half = self.width / 2.0
        return self._replace(skew=self.skew - half, width=half), self._replace(skew=self.skew + half, width=half)


def clearance_between(
    first: Mover,
    second: Mover,
    *,
    margin: float = 0.0,
    skew: float = 0.0,
    tolerance: float | None = CLEARANCE_TOLERANCE,
) -> ClearanceBetween:
    """Prove that two movers keep a margin from each other at all times.

    Args:
        first: A robot or an object.
        second: Another one.
        margin: The least distance, m.
        skew: The largest time by which one of them may start before or after the other, s.
        tolerance: The accuracy of the least distance without a skew, m; None: only the margin is proved, which is
            faster.

    Raises:
        InvalidProblem: The margin or the skew is negative or not finite.
        StartInCollision: They are nearer than the margin before both start.
        Collision: They come nearer than the margin later, perhaps only with a skew.
        ClearanceUnproved: The proof takes too long.

    Examples:
        >>> import planner
        >>> robot = planner.load_robot("kuka_kr16_2")
        >>> start = planner.Pose([3.0, -1.0, 0.5])
        >>> part = planner.Mover.sliding("part", [planner.Sphere(0.1)], start, [0.0, 0.5, 0.0], 4.0)
        >>> plan = planner.plan(planner.PlanningProblem(robot, [robot.middle, robot.middle + 0.3]))
        >>> planner.clearance_between(planner.Mover.of_plan("arm", plan), part, margin=0.1, skew=0.05).movers
        ('arm', 'part')
    """
    faults = [
        ((name,), f"must be finite and 0 or more; got {value:g}")
        for name, value in (("margin", margin), ("skew", skew))
        if not 0.0 <= value < np.inf
    ]
    if faults:
        raise InvalidProblem(faults)
    names = first.name, second.name
    waiting: list[tuple[float, int, Part]] = []
    count, lower, nearest = 0, np.inf, None
    for skews in (0.0, skew) if skew else (0.0,):
        for part in _parts(first, second, margin, skews):
            count += 1
            heappush(waiting, (-np.inf, count, part))
    while waiting:
        *_, part = heappop(waiting)
        found, moved = _found(part, margin, tolerance)
        if found.is_proved:
            lower = min(lower, max(margin - CONTACT_TOLERANCE, float(found.lower[ITSELF]) - moved))
            near = found.nearest[ITSELF]
            if near is not None and not part.width and (nearest is None or near.distance < nearest[0]):
                nearest = near.distance, part.begin + near.time, _names(names, part.checker, near.pair)
            continue
        near = found.hit or found.undecided
        if near is None:
            raise ValueError("an unproved part has a pair")
        needed = float(part.checker.margins_of(np.array([near.pair]))[0])
        if needed - near.distance > CONTACT_TOLERANCE and found.hit is not None:
            raise _refusal(first, second, part, near._replace(margin=needed), margin)
        if not part.width or count > MOST_PROOFS:
            raise _unproved(names, part.checker, near, part)
        for half in part.halves():
            count += 1
            heappush(waiting, (near.distance - needed, count, half))
    uncertainty = max(a.uncertainty + b.uncertainty for a in first.phases for b in second.phases)
    clearance = Clearance(lower, None, None, None, "certified", "estimate" if uncertainty else "model", uncertainty)
    if nearest is not None:
        clearance = replace(clearance, upper=nearest[0], time=nearest[1], pair=nearest[2])
    return ClearanceBetween(names, clearance, skew)


def _found(part: Part, margin: float, tolerance: float | None) -> tuple[Clearances, float]:
    """Prove a part; return the clearance at its middle skew, and the largest reduction by other skews, m."""
    own, other = part.phases
    begin, end = part.begin + part.skew, part.end + part.skew
    motion = side_by_side(own.between(part.begin, part.end), other.between(begin, end))
    margins = _margins(part.phases, margin)
    if not part.width:
        return clearances(part.checker, motion, tolerance=tolerance), float((margins - margin).max())
    margins = margins + other.displacements_within(begin - part.width, end + part.width, part.width)
    return clearances(part.checker.with_margins(margins), motion), float((margins - margin).max())


def _parts(first: Mover, second: Mover, margin: float, skew: float) -> Iterator[Part]:
    """Yield the pairs of phases that meet in time."""
    start = min(0.0, first.phases[0].start, second.phases[0].start) - skew
    stop = max(first.duration, second.duration) + skew
    for a in first.phases:
        for b in second.phases:
            begin, end = max(a.begin, b.begin - skew, start), min(a.end, b.end + skew, stop)
            if begin < end:
                yield Part((a, b), CheckerBetween(a.bodies, b.bodies, _margins((a, b), margin)), begin, end, 0.0, skew)


def _margins(phases: tuple[Phase, Phase], margin: float) -> FloatArray:
    """Return the margins (first, second) of pairs of bodies with the displacements by following errors, m."""
    first, second = phases
    return margin + first.displacements[:, None] + second.displacements


def _names(movers: tuple[str, str], checker: CheckerBetween, pair: int) -> tuple[str, str]:
    first, second = checker.names(pair)
    return f"{movers[0]}/{first}", f"{movers[1]}/{second}"


def _refusal(first: Mover, second: Mover, part: Part, hit: Nearest, margin: float) -> Collision:
    """Build the refusal of two movers with a pair below its margin, or nearer than it before both start."""
    begin = next(_parts(first, second, margin, 0.0))
    begin = begin._replace(begin=begin.begin - 1.0, end=begin.begin)
    at_start = _found(begin, margin, None)[0].hit
    if at_start is not None:
        part, hit = begin, at_start
    pair = _names((first.name, second.name), part.checker, hit.pair)
    time = part.begin + hit.time
    near = (
        f"{pair[0]} would be {-hit.distance:.3g} m inside of {pair[1]}"
        if hit.distance <= 0.0
        else f"{pair[0]} would come within {hit.distance:.4g} m of {pair[1]}, with a margin of {margin:g} m"
    )
    fields: dict[str, Any] = {
        "pair": pair,
        "depth": hit.missing,
        "point": hit.point if np.isfinite(hit.point).all() else None,
        "position": part.phases[0].between(time, time).coefficients[0, :, 0],
        "value": hit.distance,
        "limit": hit.margin,
        "time": time,
    }
    if at_start is not None:
        return StartInCollision(f"before both start, {near}", **fields)
    skewed = f" if {second.name} is {abs(part.skew):.4g} s {'ahead' if part.skew > 0 else 'late'}" if part.skew else ""
    return Collision(f"at {time:.4g} s, {near}{skewed}", **fields)


def _unproved(names: tuple[str, str], checker: CheckerBetween, near: Nearest, part: Part) -> ClearanceUnproved:
    """Build the refusal of two movers whose clearance is not proved."""
    pair, time = _names(names, checker, near.pair), part.begin + near.time
    message = (
        f"the clearance of {pair[0]} and {pair[1]} near {time:.4g} s could not be proved: "
        "they come as near as their margin, or nearly so, for long"
    )
    return ClearanceUnproved(message, pair=pair, time=time, value=near.distance, limit=near.margin)
