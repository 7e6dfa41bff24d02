"""Joint positions that differ by whole turns, and their distances."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import ArrayLike

from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

TURN = 2.0 * np.pi
"""A whole turn, rad."""


def nearest_turn(robot: Robot, positions: FloatArray, reference: FloatArray) -> FloatArray:
    """Turn every angle of configurations (..., joints) to lie nearest to `reference` within its limits.

    An angle that no turn brings within its limits is turned as close to them as possible. The caller can correct an
    excess of rounding.
    """
    lower, upper = robot.limit("lower"), robot.limit("upper")
    fewest, most = turns_within(robot, positions)
    turns = np.minimum(np.maximum(np.round((reference - positions) / TURN), fewest), most)
    outside = np.where(robot.is_angle, np.round((robot.middle - positions) / TURN), 0.0)
    turned = positions + TURN * np.where(fewest <= most, turns, outside)
    within = np.minimum(np.maximum(turned, lower), upper)
    return np.where(np.abs(turned - within) <= TURN * ROUNDING, within, turned)


def turned_to(robot: Robot, position: ArrayLike, towards: FloatArray, still: Collection[str] = ()) -> FloatArray:
    """Turn continuous joints of a position (joints,), except some, to the turn nearest to another (joints,)."""
    q = np.asarray(position, dtype=np.float64)
    turns = np.round((towards - q) / TURN)
    return q + TURN * np.where([one.kind == "continuous" and one.name not in still for one in robot.joints], turns, 0.0)


def turns_within(robot: Robot, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the fewest and most whole turns (..., joints) within the limits; 0 for prismatic joints.

    Fewest is more than most for an angle that no turn brings within its limits.
    """
    lower, upper = robot.limit("lower"), robot.limit("upper")
    with np.errstate(invalid="ignore"):
        fewest = np.where(robot.is_angle, np.ceil((lower - positions) / TURN - ROUNDING), 0.0)
        most = np.where(robot.is_angle, np.floor((upper - positions) / TURN + ROUNDING), 0.0)
    return fewest, most


def with_whole_turns(
    robot: Robot, solutions: tuple[FloatArray, ...], reference: FloatArray, most: int
) -> tuple[FloatArray, ...]:
    """Return the solutions and what whole turns of their joints make of them within finite limits.

    Nearest to the reference first; of more than `most`, the nearest.
    """
    lower, upper = robot.limit("lower"), robot.limit("upper")
    turned = []
    for solution in solutions:
        variants = nearest_turn(robot, solution, reference)[None]
        for joint in np.flatnonzero(robot.is_angle & np.isfinite(upper - lower)):
            values = variants[0, joint] + TURN * np.arange(-most, most + 1)
            values = values[(values >= lower[joint] - ROUNDING) & (values <= upper[joint] + ROUNDING)]
            variants = np.repeat(variants, len(values), axis=0)
            variants[:, joint] = np.tile(values, len(variants) // len(values))
            # The distance is a sum over the joints: what is far already does not come near again.
            variants = np.array(by_distance(robot, variants, reference)[:most])
        turned += list(np.clip(variants, lower, upper))
    return tuple(by_distance(robot, turned, reference)[:most])


def by_distance(robot: Robot, solutions: Sequence[FloatArray] | FloatArray, reference: FloatArray) -> list[FloatArray]:
    """Sort solutions by time from the reference at the velocity limits, the nearest first."""
    if len(solutions) == 0:
        return []
    times = travel_times(robot, np.array(solutions), reference)
    return [solutions[i] for i in np.argsort(times, kind="stable")]


def travel_times(robot: Robot, positions: FloatArray, reference: FloatArray) -> FloatArray:
    """Return the norms (...), s, of the joints' times at their velocity limits from positions (..., joints)."""
    away = (positions - reference) / counted_velocity(robot.limit("velocity"))
    times: FloatArray = np.sqrt((away * away).sum(axis=-1))
    return times


def distances(robot: Robot, positions: FloatArray, others: FloatArray) -> FloatArray:
    """Return the largest difference (...) of a joint between positions (..., joints), whole turns aside."""
    difference = positions - others
    difference -= np.where(robot.is_angle, TURN * np.round(difference / TURN), 0.0)
    largest: FloatArray = np.abs(difference).max(axis=-1)
    return largest


def counted_velocity(limit: FloatArray) -> FloatArray:
    """Return velocity limits as weights of joint motions; without a limit, 1 rad/s or 1 m/s."""
    return np.where(np.isfinite(limit), limit, 1.0)
