"""What helps where holding the arm still takes more torque than allowed: higher limits, a lighter payload."""

from __future__ import annotations

import numpy as np

from planner.dynamics import inverse_dynamics
from planner.errors import Remedy
from planner.paths import JointPath
from planner.planning.attempts import Attempt, Proposals
from planner.planning.proofs import first_proved
from planner.planning.remedies.higher_limits import Needs, higher_limits, lighter_payload
from planner.robots import Robot
from planner.spatial import FloatArray

GRAVITY_SHARES = (0.99, 0.9, 0.5)
"""Shares of a torque limit that gravity may take; the first is offered that leaves enough for the motion."""

GRAVITY_POSITIONS = 200
"""The number of positions on each group for which gravity is computed."""

MOVED = "a torque limit that holds the arm and leaves some to move it"
"""The explanation of a higher limit, for a person."""

HELD = "the heaviest payload, kg, that leaves torque for the motion"
"""The explanation of a lighter payload, for a person."""


def holding_remedies(attempt: Attempt) -> Proposals[list[Remedy]]:
    """Find remedies where gravity with Coulomb friction exceeds a torque limit on a path; none where it does not."""
    path = attempt.path
    if path is None or not path.dynamics.has_dynamics:
        return []
    positions, segments = _positions_along(path)
    still = np.zeros_like(positions)

    def gravity(robot: Robot, rows: np.ndarray) -> FloatArray:
        return inverse_dynamics(robot, positions[rows], still[rows], still[rows])

    friction = path.robot.friction
    resisting = 0.0 if friction is None else friction.coulomb
    limit = path.limits.torque.narrower[segments] - resisting
    taken = np.abs(path.dynamics.torques(segments, positions, still, still))
    needs: Needs = {}
    for row, joint in np.argwhere(taken >= limit).tolist():
        key = "torque", int(segments[row]), joint
        needs[key] = max(float((taken + resisting)[row, joint]), needs.get(key, 0.0))
    if not needs:
        return []
    higher = yield from first_proved(higher_limits(attempt, needs, GRAVITY_SHARES, MOVED), attempt)
    lighter = lighter_payload(attempt.with_detours, gravity, segments, limit, GRAVITY_SHARES, HELD)
    return higher + (yield from first_proved(lighter, attempt))


def _positions_along(path: JointPath) -> tuple[FloatArray, np.ndarray]:
    """Return positions (N, joints) all along the path and where the robot rests, and the segment (N,) of each.

    A position between two segments belongs to both.
    """
    resting = path.still if len(path.durations) else np.zeros(1, dtype=int)  # the only waypoint counts as a segment
    positions, segments = [path.positions[resting]], [resting]
    for group in path.every_group:
        curve = group.curve
        s = np.linspace(0.0, curve.breakpoints[-1], GRAVITY_POSITIONS)
        own = curve.segments[curve.locate(s)[0]]
        positions += [curve.evaluate(s, [0])[0], curve.evaluate(curve.breakpoints[1:], [0])[0]]
        segments += [own, curve.segments]
    return np.concatenate(positions), np.concatenate(segments)
