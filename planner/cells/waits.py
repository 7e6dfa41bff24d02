"""The search for waits of robots on fixed paths, each proved to keep all robots apart."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from time import monotonic

import numpy as np

from planner.cells.clearance import proved_between
from planner.cells.coordination import coordinated
from planner.cells.diagram import Axis, Diagram
from planner.cells.meetings import Meeting, with_meetings, without_meetings
from planner.cells.movers import Mover, Rules
from planner.cells.robots import index_in_plan
from planner.errors import ClearanceUnproved, Collision, StartInCollision
from planner.plans.result import Plan
from planner.problems.problem import ViaWaypoint
from planner.problems.transitions import StopTransition
from planner.spatial import FloatArray

CELLS_OF_LONGEST = (128, 256, 512)
"""Number of cells of the longest trajectory, in each of the searches for waits."""

SHARES = (1.0, 0.5, 0.0)
"""Shares of the excursions in a cell of a diagram. For 1 the waits found are proved, for 0 they are the shortest."""

WAITS_GAP = 0.02
"""Largest part by which a cell may end later than by the shortest waits of a diagram; else a finer diagram follows."""

BLOCKS_OF_WAITS = 2_000
"""The largest number of decided blocks of a pair while waits are chosen: waits that need more become longer."""

WAIT_ACCURACY = 1e-3
"""Accuracy of waits, s: they are shortened until so much less breaks a margin."""


@dataclass(frozen=True, eq=False)
class Member:
    """A robot of a cell on its trajectory without waits.

    Attributes:
        waypoints: (rests,), the waypoint of its plan at each rest; the last one is its end.
        rests: (rests,), s: when it leaves these waypoints, and when it ends.
    """

    waypoints: tuple[int, ...]
    rests: FloatArray

    @classmethod
    def of(cls, own: Plan) -> Member:
        """Return the robot of a plan."""
        waypoints, last = own.problem.waypoints, len(own.problem.waypoints) - 1
        stops = [
            k
            for k, waypoint in enumerate(waypoints)
            if k in (0, last)
            or (isinstance(waypoint.transition, StopTransition) and not isinstance(waypoint, ViaWaypoint))
        ]
        times = own.trajectory.departures[stops]
        times[-1] = own.trajectory.duration
        is_later = np.append(np.diff(times) > 0.0, True)
        return cls(tuple(np.array(stops)[is_later].tolist()), np.asarray(times[is_later]))

    def rest_at(self, own: Plan, requested: int) -> int:
        """Return the number of the rest at a requested waypoint of a plan."""
        return int(np.searchsorted(self.waypoints, index_in_plan(own, requested)))

    def by_waypoint(self, own: Plan, waits: FloatArray) -> tuple[float, ...]:
        """Return the waits (rests,) by requested waypoint."""
        numbers = own.requested_indices
        found = [0.0] * (max(numbers) + 1)
        for waypoint, wait in zip(self.waypoints, waits.tolist(), strict=True):
            found[numbers[waypoint]] += wait
        return tuple(found)


Pair = tuple[int, int]
"""The indices of two robots, the lower one first."""


@dataclass(frozen=True, eq=False)
class WaitSearch:
    """The search for waits of robots of a cell.

    Attributes:
        members: The robots.
        movers: The movers of each pair of robots.
        rules: What each pair keeps.
        meetings: The meetings in the order of time, with numbers of rests.
        end: The end of the search on the monotonic clock, s.
    """

    members: Sequence[Member]
    movers: Mapping[Pair, tuple[Mover, Mover]]
    rules: Rules
    meetings: Sequence[Meeting]
    end: float

    def found(self) -> tuple[list[FloatArray], tuple[float, ...]]:
        """Find proved waits (rests,) of each robot, s, and the times of meetings, s.

        Raises:
            Collision: No waits do, or none are found in time.
            ClearanceUnproved: None are found.
        """
        none = [np.zeros(len(member.rests)) for member in self.members]
        refusal = self.refusal(none)
        if refusal is None:
            return self.with_meetings(none)
        if isinstance(refusal, StartInCollision):
            raise refusal
        longest = max(float(member.rests[-1]) for member in self.members)
        best: list[FloatArray] | None = None
        for count in CELLS_OF_LONGEST:
            if monotonic() > self.end:
                break
            bound = None
            for waits in self._coordinated(longest / count):
                duration = self._duration(waits)
                bound = duration if bound is None else bound
                if best is not None and duration >= self._duration(best):
                    break
                if self.refusal(waits) is None:
                    best = waits
                    break
            if bound is None and count > CELLS_OF_LONGEST[0]:
                break  # two diagrams without any path
            if best is not None and bound is not None and self._duration(best) <= (1.0 + WAITS_GAP) * bound:
                break
        if best is not None:
            return self.with_meetings(self._shortened(best))
        reason = "no waits where the robots rest keep them apart"
        if monotonic() > self.end:
            reason = "no waits that keep the robots apart were found in time"
        raise refusal.with_fields(_text=f"{reason}; without waits: {refusal._text}")

    def with_meetings(self, waits: Sequence[FloatArray]) -> tuple[list[FloatArray], tuple[float, ...]]:
        """Return waits with the waits at meetings, and the times of meetings, s."""
        return with_meetings(self.meetings, [member.rests for member in self.members], waits)

    def refusal(self, waits: Sequence[FloatArray]) -> Collision | ClearanceUnproved | None:
        """Return the refusal of robots with waits; None: they are proved to keep clear of each other."""
        added, _ = self.with_meetings(waits)
        for pair, movers in self.movers.items():
            first, second = (
                mover.waiting(self.members[k].rests, added[k]) for k, mover in zip(pair, movers, strict=True)
            )
            try:
                proved_between(first, second, self.rules, tolerance=None, blocks=BLOCKS_OF_WAITS)
            except (Collision, ClearanceUnproved) as refusal:
                return refusal
        return None

    def _duration(self, waits: Sequence[FloatArray]) -> float:
        """Return the time at which the last robot ends, s."""
        added, _ = self.with_meetings(waits)
        return max(float(member.rests[-1] + own.sum()) for member, own in zip(self.members, added, strict=True))

    def _coordinated(self, step: float) -> Iterator[list[FloatArray]]:
        """Yield waits besides the waits at meetings, by diagrams of cells of a length, s: the shortest first."""
        rests = [member.rests for member in self.members]
        diagrams = {}
        for (i, j), (one, other) in self.movers.items():
            axes = Axis(one, step, rests[i]), Axis(other, step, rests[j])
            diagrams[i, j] = Diagram.of(*axes, self.rules, SHARES, self.end)
        any_mover = {k: mover for pair, both in self.movers.items() for k, mover in zip(pair, both, strict=True)}
        cells = tuple(Axis(any_mover[k], step, own) for k, own in enumerate(rests))
        for number in reversed(range(len(SHARES))):
            of_share = {pair: own[number] for pair, own in diagrams.items()}
            widening = int(np.ceil(self.rules.skew / step))
            found = coordinated(cells, of_share, widening, self.meetings, self.end)
            if found is None:
                return
            waits = [own.astype(np.float64) * step for own in found]
            for axis, own in zip(cells, waits, strict=True):
                own[1:-1] += (axis.counts * step - np.diff(axis.rests))[:-1]
            yield without_meetings(self.meetings, rests, waits)

    def _shortened(self, waits: Sequence[FloatArray]) -> list[FloatArray]:
        """Shorten waits as far as the robots are proved to keep clear, until the end of the search."""
        best = [own.copy() for own in waits]
        for k, own in enumerate(waits):
            for rest in np.flatnonzero(own > 0.0).tolist():
                low, high = 0.0, float(own[rest])
                if monotonic() > self.end:
                    return best
                best[k][rest] = low
                if self.refusal(best) is None:
                    continue
                while high - low > WAIT_ACCURACY and monotonic() <= self.end:
                    best[k][rest] = (low + high) / 2.0
                    if self.refusal(best) is None:
                        high = best[k][rest]
                    else:
                        low = best[k][rest]
                best[k][rest] = high
        return best
