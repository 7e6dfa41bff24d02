"""The proof that no point of a robot is faster near objects than its speed zones allow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from planner.errors import LimitsUnsatisfiable
from planner.robots import Robot
from planner.scene.bodies import Bodies
from planner.scene.checker import CollisionChecker
from planner.speed_zones import SpeedZone, fast_intervals, most_speed, moving_bodies, near_intervals, speed_reached
from planner.tolerances import LIMIT_TOLERANCE
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import Trajectory

TIMES = ("intervals", "exceeded")
"""Names of the attributes of a check that are times from and to."""


@dataclass(frozen=True)
class SpeedZoneCheck:
    """The highest speed of a robot in one of its speed zones.

    Attributes:
        clearance: The zone: where the robot may be nearer than this to its objects, m.
        objects: Names of these objects; None: all of the scene.
        peak: m/s, proved: no point of the robot is ever faster in the zone; 0 where it never is in it.
        limit: The speed allowed there, m/s.
        ratio: Share of it that is used.
        time: When the robot is about that fast, s; None: it never is in the zone.
        intervals: When it is in the zone, from and to, s; at all other times it is proved to be further away.
        method: How it is known; the bounds hold between all samples.
        lower: m/s: a point of the robot is that fast at this time; the highest speed is between this and the peak.
        link: Name of the link or carried object with this point; `tool`: the tool centre point.
        exceeded: When a point may be faster than is allowed, from and to, s; at all other times none is.

    Examples:
        >>> import planner
        >>> planner.SpeedZoneCheck(0.5, ("walkway",), 0.248, 0.25, 0.992, 1.75, ((1.2, 2.4),)).satisfied
        True
    """

    clearance: float
    objects: tuple[str, ...] | None
    peak: float
    limit: float
    ratio: float
    time: float | None
    intervals: tuple[tuple[float, float], ...]
    method: Literal["certified"] = "certified"
    lower: float = 0.0
    link: str | None = None
    exceeded: tuple[tuple[float, float], ...] = ()

    @property
    def satisfied(self) -> bool:
        """Whether the speed stays within its limit."""
        return self.ratio <= 1.0 + LIMIT_TOLERANCE

    def as_dict(self) -> dict[str, Any]:
        """Return the check in plain values, ready for JSON."""
        objects = None if self.objects is None else list(self.objects)
        times = {name: [list(interval) for interval in getattr(self, name)] for name in TIMES}
        return {**vars(self), "objects": objects, **times, "satisfied": self.satisfied}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> SpeedZoneCheck:
        """Read what `as_dict` wrote."""
        objects = None if values["objects"] is None else tuple(values["objects"])
        times = {name: tuple((start, end) for start, end in values.get(name, ())) for name in TIMES}
        own = {name: value for name, value in values.items() if name != "satisfied"}
        return cls(**own | {"objects": objects, **times})


def certify_speed_zones(
    zones: Sequence[SpeedZone], checkers: Sequence[CollisionChecker], robots: Sequence[Robot], trajectory: Trajectory
) -> tuple[SpeedZoneCheck, ...]:
    """Bound the speed of a robot in each of its speed zones.

    Args:
        zones: The zones.
        checkers: The robot and its obstacles on each segment; one: on all of them.
        robots: The robot with its tool on each segment; one: on all of them.
        trajectory: A trajectory from any source.
    """
    parts = list(_parts(checkers, robots, trajectory)) if zones else []
    return tuple(_check(zone, parts) for zone in zones)


def refuse_too_fast(checks: Sequence[SpeedZoneCheck]) -> None:
    """Refuse a trajectory that is too fast in a speed zone.

    Raises:
        LimitsUnsatisfiable: Naming the first of these zones, how fast the robot would be, and when.
    """
    for check in checks:
        if not check.satisfied:
            objects = "objects" if check.objects is None else " or ".join(check.objects)
            raise LimitsUnsatisfiable(
                f"nearer than {check.clearance:g} m to {objects}, a point of {check.link} would move at "
                f"{check.peak:.6g} m/s, the limit there is {check.limit:g} m/s",
                value=check.peak,
                limit=check.limit,
                time=check.time,
            )


_Part = tuple["CollisionChecker", "Bodies", PiecewisePolynomial, float]
"""A part of a trajectory without changes: its checker, its moving bodies, its motion and its start, s."""


def _parts(checkers: Sequence[CollisionChecker], robots: Sequence[Robot], trajectory: Trajectory) -> Iterator[_Part]:
    """Yield the parts of a trajectory on which nothing changes."""
    held = [(checkers[min(k, len(checkers) - 1)], robots[min(k, len(robots) - 1)]) for k in trajectory.segments]
    changes = [k for k in range(1, len(held)) if any(a is not b for a, b in zip(held[k], held[k - 1], strict=True))]
    for first, last in pairwise([0, *changes, len(held)]):
        checker, robot = held[first]
        part = PiecewisePolynomial(trajectory.lengths[first:last], trajectory.coefficients[first:last])
        yield checker, moving_bodies(robot, checker), part, float(trajectory.breakpoints[first])


def _check(zone: SpeedZone, parts: Sequence[_Part]) -> SpeedZoneCheck:
    peak, time, lower, link, found, exceeded = 0.0, None, 0.0, None, [np.empty((0, 2))], [np.empty((0, 2))]
    for checker, bodies, motion, begin in parts:
        intervals = near_intervals(checker, motion, zone.clearance, zone.objects)
        if not len(intervals):
            continue
        found.append(intervals + begin)
        speed, at = most_speed(bodies, motion, intervals, zone.speed)
        if speed > zone.speed * (1.0 + LIMIT_TOLERANCE):
            fast = fast_intervals(bodies, motion, intervals, zone.speed)
            exceeded.append(fast + begin)
            speed = speed if len(fast) else zone.speed
        if time is None or speed > peak:
            peak, time = speed, begin + at
            lower, link = speed_reached(bodies, motion, at)
    objects = None if zone.objects is None else tuple(zone.objects)
    near, fast_at = (
        tuple((start, end) for start, end in np.concatenate(times).tolist()) for times in (found, exceeded)
    )
    return SpeedZoneCheck(
        zone.clearance,
        objects,
        peak,
        zone.speed,
        peak / zone.speed,
        time,
        near,
        lower=lower,
        link=link,
        exceeded=fast_at,
    )
