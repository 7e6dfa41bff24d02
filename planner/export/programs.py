"""What programs of robots share: six turning joints, and motions from rest to rest as points and times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import UnsupportedFormat
from planner.tolerances import NEGLIGIBLE_SHARE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.kinematics import FloatArray
    from planner.result import Plan

JOINTS = 6
"""The number of joints of the arms that these programs move."""

AT_START = 0.01
"""How far a joint may be from the start, rad; further away a program halts in place of going there."""

SHORTEST_PERIOD = 0.004
"""The shortest sample period that programs take, s: controllers interpolate points no faster than that."""


@dataclass(frozen=True, eq=False)
class Move:
    """A motion from rest to rest, and the rest after it.

    Attributes:
        time: (N,), s from the start of the motion, strictly increasing from 0; N is 1 where there is only a rest.
        position: (N, joints), rad.
        rest: How long the robot rests at its end, s.
    """

    time: FloatArray
    position: FloatArray
    rest: float


def moves(plan: Plan, language: str, period: float) -> list[Move]:
    """Cut a plan where the robot rests, and sample each motion.

    Args:
        plan: The plan of an arm with six joints that turn.
        language: The name of the language, for the refusal.
        period: The time between points, s; the last point of a motion is at its end.

    Raises:
        UnsupportedFormat: The arm is another, the trajectory begins or ends in motion, or the period is too short.
    """
    robot, trajectory = plan.path.robot, plan.trajectory
    if robot.dof != JOINTS or not robot.is_angle.all():
        raise UnsupportedFormat(f"{language} moves arms of {JOINTS} joints that turn, which {robot.id} is not")
    if period < SHORTEST_PERIOD:
        raise UnsupportedFormat(f"{language} takes points {SHORTEST_PERIOD:g} s apart or more, not {period:g} s")
    peak = max((check.peak for check in plan.certificate.checks if check.quantity == "velocity"), default=0.0)
    speeds = np.abs(trajectory.evaluate(trajectory.arrivals, [1])[0]).max(axis=1)
    is_stop = speeds <= NEGLIGIBLE_SHARE * max(peak, 1.0)
    if not (is_stop[0] and is_stop[-1]):
        raise UnsupportedFormat(f"{language} begins and ends at rest, which this trajectory does not")
    return list(_between(plan, np.flatnonzero(is_stop).tolist(), period))


def _between(plan: Plan, stops: list[int], period: float) -> Iterator[Move]:
    """Make a motion between each two stops."""
    trajectory = plan.trajectory
    arrivals, departures = trajectory.arrivals, trajectory.departures
    for before, after in zip([stops[0], *stops], stops, strict=False):
        start, end = (arrivals[after], arrivals[after]) if before == after else (departures[before], arrivals[after])
        count = max(int(np.ceil((end - start) / period * (1.0 - NEGLIGIBLE_SHARE))), 0)
        time = np.append(start + np.arange(count) * period, end)
        position = trajectory.evaluate(time, [0])[0]
        rest = float(departures[after] - arrivals[after])
        if (position == position[0]).all():  # it only rests
            yield Move(np.zeros(1), position[:1], rest + float(end - start))
        else:
            yield Move(time - start, position, rest)


def numbers(values: FloatArray, decimals: int = 6) -> list[str]:
    """Write numbers with so many decimals, without an exponent, which not every controller reads."""
    return [f"{value:.{decimals}f}" for value in values.tolist()]
