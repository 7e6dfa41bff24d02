"""The proof that two movers keep clear of each other at all times, for every start skew of their controllers.

Without a skew, both movers move together like one robot with the joints of both, and the proof of one robot holds. A
start skew e shifts the second trajectory: time t of the first trajectory meets time t + e of the second one. Intervals
of t and ranges of e are blocks, as in a coordination diagram. A block is free where every pair of bodies keeps its
margin in spite of the largest displacements of both. Otherwise it is halved.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from planner.cells.movers import Mover, Rules
from planner.certificate.clearance import CLEARANCE_TOLERANCE, Clearance
from planner.errors import ClearanceUnproved, Collision, InvalidProblem, StartInCollision
from planner.fields import FieldPath
from planner.kernels.clearance import FREE_BLOCK
from planner.scene.between import CheckerBetween
from planner.scene.blocks import BLOCKS_AT_ONCE
from planner.scene.checker import CONTACT_TOLERANCE, ITSELF
from planner.scene.continuous import Clearances, Nearest, clearances
from planner.scene.phases import Phase, side_by_side
from planner.spatial import FloatArray

MOST_BLOCKS = 100_000
"""The largest number of blocks of times and skews that are decided for one pair of movers."""


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
    """A pair of phases in the interval of time, s, in which both meet."""

    phases: tuple[Phase, Phase]
    checker: CheckerBetween
    begin: float
    end: float

    def clearances(self, begin: float, end: float, skew: float, tolerance: float | None) -> Clearances:
        """Prove the margins in an interval of time, s, for one skew, s."""
        first, second = self.phases
        motion = side_by_side(first.between(begin, end), second.between(begin + skew, end + skew))
        return clearances(self.checker, motion, tolerance=tolerance)


def clearance_between(
    first: Mover,
    second: Mover,
    *,
    margin: float = 0.0,
    skew: float = 0.0,
    allowed_pairs: Sequence[tuple[str, str]] = (),
    tolerance: float | None = CLEARANCE_TOLERANCE,
    blocks: int = MOST_BLOCKS,
) -> ClearanceBetween:
    """Prove that two movers keep a margin from each other at all times.

    Args:
        first: A robot or an object.
        second: Another one.
        margin: The least distance, m.
        skew: The largest time by which one of them may start before or after the other, s.
        allowed_pairs: Pairs that may touch, by the names `mover/link` or `mover/object`.
        tolerance: The accuracy of the least distance without a skew, m; None: only the margin is proved, which is
            faster.
        blocks: The largest number of blocks of times and skews that are decided.

    Raises:
        InvalidProblem: The margin or the skew is negative or not finite, or a pair names no body of both.
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
    faults: list[tuple[FieldPath, str]] = [
        ((name,), f"must be finite and 0 or more; got {value:g}")
        for name, value in (("margin", margin), ("skew", skew))
        if not 0.0 <= value < np.inf
    ]
    names = [
        {f"{own.name}/{body.name}" for phase in own.phases for body in phase.bodies.pieces} for own in (first, second)
    ]
    for i, pair in enumerate(allowed_pairs):
        if not any(one in names[0] and other in names[1] for one, other in (pair, pair[::-1])):
            message = (
                f"must have a name `{first.name}/body` and a name `{second.name}/body`; got {pair[0]!r} and {pair[1]!r}"
            )
            faults.append((("allowed_pairs", i), message))
    if faults:
        raise InvalidProblem(faults)
    rules = Rules.of(margin, skew, allowed_pairs)
    return proved_between(first, second, rules, tolerance=tolerance, blocks=blocks)


def proved_between(
    first: Mover,
    second: Mover,
    rules: Rules,
    *,
    tolerance: float | None = CLEARANCE_TOLERANCE,
    blocks: int = MOST_BLOCKS,
) -> ClearanceBetween:
    """Prove that two movers keep rules; see `clearance_between`.

    Raises:
        Collision, ClearanceUnproved: See `clearance_between`.
    """
    names, lower = (first.name, second.name), np.inf
    nearest: tuple[float, float, tuple[str, str]] | None = None
    for part in _parts(first, second, rules, 0.0):
        found = part.clearances(part.begin, part.end, 0.0, tolerance)
        if found.hit is not None:
            raise _refusal(first, second, part, found.hit, part.begin, 0.0, rules)
        if found.undecided is not None:
            raise _unproved(names, part, found.undecided.pair, part.begin + found.undecided.time)
        displaced = sum(float(phase.displacements.max(initial=0.0)) for phase in part.phases)
        lower = min(lower, float(found.lower[ITSELF]) - displaced)
        near = found.nearest[ITSELF]
        if near is not None and (nearest is None or near.distance < nearest[0]):
            nearest = near.distance, part.begin + near.time, _names(names, part.checker, near.pair)
    for part in _parts(first, second, rules, rules.skew) if rules.skew else ():
        _refuse_skewed(first, second, part, rules, blocks)
    lower = min(max(lower, rules.margin - CONTACT_TOLERANCE), rules.margin if rules.skew or nearest is None else np.inf)
    uncertainty = max(a.uncertainty + b.uncertainty for a in first.phases for b in second.phases)
    clearance = Clearance(lower, None, None, None, "certified", "estimate" if uncertainty else "model", uncertainty)
    if nearest is not None:
        clearance = replace(clearance, upper=nearest[0], time=nearest[1], pair=nearest[2])
    return ClearanceBetween(names, clearance, rules.skew)


def _refuse_skewed(first: Mover, second: Mover, part: Part, rules: Rules, most: int) -> None:
    """Prove the margins of a part for all skews.

    Raises:
        Collision: A pair is below its margin for a skew.
        ClearanceUnproved: Too many blocks are neither free nor blocked.
    """
    skew = rules.skew
    for shift in (-skew, skew):  # where most that touch do so
        hit = part.clearances(part.begin, part.end, shift, None).hit
        if hit is not None:
            raise _refusal(first, second, part, hit, part.begin, shift, rules)
    waiting, count = np.array([[part.begin, part.end, -skew, skew]]), 0
    while len(waiting):
        now, waiting = waiting[-BLOCKS_AT_ONCE:], waiting[:-BLOCKS_AT_ONCE]
        begin, end, low, high = now.T
        positions, reach = zip(
            part.phases[0].within(begin, end), part.phases[1].within(begin + low, end + high), strict=True
        )
        nowhere = np.zeros(len(now), dtype=int)
        undecided = now[part.checker.distances.decide(np.hstack(positions), np.hstack(reach), nowhere) != FREE_BLOCK]
        count += len(now)
        if count > most and len(undecided):
            t0, t1, e0, e1 = undecided[0].tolist()
            found = part.clearances(t0, t1, (e0 + e1) / 2.0, np.inf)
            if found.hit is not None:
                raise _refusal(first, second, part, found.hit, t0, (e0 + e1) / 2.0, rules)
            near = found.nearest[ITSELF]
            raise _unproved((first.name, second.name), part, 0 if near is None else near.pair, t0)
        waiting = np.concatenate([waiting, _halved(undecided)])


def _halved(blocks: FloatArray) -> FloatArray:
    """Return the halves of blocks (N, 4), along the interval of time or the range of skews, the longer."""
    longer = np.where(blocks[:, 1] - blocks[:, 0] >= blocks[:, 3] - blocks[:, 2], 0, 2)
    rows = np.arange(len(blocks))
    middles = (blocks[rows, longer] + blocks[rows, longer + 1]) / 2.0
    low, high = blocks.copy(), blocks.copy()
    low[rows, longer + 1], high[rows, longer] = middles, middles
    return np.concatenate([low, high])


def _parts(first: Mover, second: Mover, rules: Rules, skew: float) -> Iterator[Part]:
    """Yield the pairs of phases that meet in time."""
    start = min(0.0, first.phases[0].start, second.phases[0].start) - skew
    stop = max(first.duration, second.duration) + skew
    for a in first.phases:
        for b in second.phases:
            begin, end = max(a.begin, b.begin - skew, start), min(a.end, b.end + skew, stop)
            if begin < end:
                margins = rules.margins((first, second), (a, b))
                yield Part((a, b), CheckerBetween(a.bodies, b.bodies, margins), begin, end)


def _names(movers: tuple[str, str], checker: CheckerBetween, pair: int) -> tuple[str, str]:
    first, second = checker.names(pair)
    return f"{movers[0]}/{first}", f"{movers[1]}/{second}"


def _refusal(
    first: Mover, second: Mover, part: Part, hit: Nearest, begin: float, skew: float, rules: Rules
) -> Collision:
    """Build the refusal of two movers with a pair below its margin, or nearer than it before both start."""
    earliest = next(_parts(first, second, rules, 0.0))
    at_start = earliest.clearances(earliest.begin - 1.0, earliest.begin, 0.0, None).hit
    if at_start is not None:
        part, hit, begin, skew = earliest, at_start, earliest.begin - 1.0, 0.0
    pair = _names((first.name, second.name), part.checker, hit.pair)
    time = begin + hit.time
    near = (
        f"{pair[0]} would be {-hit.distance:.3g} m inside of {pair[1]}"
        if hit.distance <= 0.0
        else f"{pair[0]} would come within {hit.distance:.4g} m of {pair[1]}, with a margin of {rules.margin:g} m"
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
        return StartInCollision(f"before both start, {near}", **fields | {"time": 0.0})
    skewed = f" if {second.name} is {abs(skew):.4g} s {'ahead' if skew > 0 else 'late'}" if skew else ""
    return Collision(f"at {time:.4g} s, {near}{skewed}", **fields)


def _unproved(names: tuple[str, str], part: Part, number: int, time: float) -> ClearanceUnproved:
    """Build the refusal of two movers whose clearance is not proved."""
    pair = _names(names, part.checker, number)
    message = (
        f"the clearance of {pair[0]} and {pair[1]} near {time:.4g} s could not be proved: "
        "they come as near as their margin, or nearly so, for long"
    )
    return ClearanceUnproved(message, pair=pair, time=time)
