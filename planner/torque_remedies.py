"""What would help where holding the arm still takes more torque than allowed: higher limits, a lighter payload."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.dynamics import inverse_dynamics
from planner.errors import Remedy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.kinematics.poses import FloatArray
    from planner.paths import JointPath
    from planner.problem import Limits, PlanningProblem
    from planner.robots import Robot

SHARES = (0.99, 0.9, 0.5)
"""Of a torque limit, what gravity may take; the first that leaves enough for the motion."""

PLACES = 200
"""On each run, where gravity is looked at."""

LEAST_LEVER = 1e-9
"""N m (N) by kg, below which a joint does not feel the payload."""

Change = tuple["PlanningProblem", list[Remedy]]
"""A changed problem, and how to say it: remedies to be applied together."""


def torque_remedies(
    problem: PlanningProblem, path: JointPath, has_plan: Callable[[PlanningProblem], bool]
) -> list[Remedy]:
    """Remedies where gravity alone exceeds a torque limit on a path; none where it does not.

    Args:
        problem: That is refused.
        path: Of the problem.
        has_plan: Whether a changed problem can be planned; only what can be is offered.
    """
    if not path.robot.has_dynamics:
        return []
    positions, segments = _places(path)
    gravity, limit = _gravity(path.robot, positions), path.limits.torque[segments]
    if not (np.abs(gravity) >= limit).any():
        return []
    remedies: list[Remedy] = []
    for changes in (_higher_limits(problem, path, gravity, segments), _lighter_payload(problem, positions, limit)):
        remedies += next((told for changed, told in changes if has_plan(changed)), [])
    return remedies


def _places(path: JointPath) -> tuple[FloatArray, np.ndarray]:
    """Positions (N, joints) all along the path, and their segments (N,); places between two segments are of both."""
    positions, segments = [], []
    for run in path.every_run:
        curve = run.curve
        s = np.linspace(0.0, curve.breakpoints[-1], PLACES)
        owners = run.owners[curve.locate(s)[0]]
        positions += [curve.evaluate(s, [0])[0], curve.evaluate(curve.breakpoints[1:], [0])[0]]
        segments += [owners, run.owners]
    return np.concatenate(positions), np.concatenate(segments)


def _gravity(robot: Robot, positions: FloatArray) -> FloatArray:
    still = np.zeros_like(positions)
    return inverse_dynamics(robot, positions, still, still)


def _higher_limits(
    problem: PlanningProblem, path: JointPath, gravity: FloatArray, segments: np.ndarray
) -> Iterator[Change]:
    """The limits asked that gravity exceeds, raised as far as the robot's own; nothing where those are exceeded."""
    own = problem.robot.limit("torque")
    for share in SHARES:
        raised: dict[tuple[str, int], float] = {}
        for row, joint in np.argwhere(np.abs(gravity) >= path.limits.torque[segments]).tolist():
            k, needed = int(segments[row]) + 1, float(abs(gravity[row, joint]))
            narrower = problem.waypoints[k].limits
            at_waypoint = narrower is not None and narrower.torque is not None
            holder = f"/waypoints/{k}/limits" if at_waypoint else "/limits"
            if needed >= own[joint]:
                return
            value = min(needed / share, float(own[joint]))
            raised[holder, joint] = max(value, raised.get((holder, joint), 0.0))
        waypoints = tuple(
            replace(waypoint, limits=_with(waypoint.limits, f"/waypoints/{k}/limits", raised))
            for k, waypoint in enumerate(problem.waypoints)
        )
        limits = _with(problem.limits, "/limits", raised) or problem.limits
        yield (
            replace(problem, limits=limits, waypoints=waypoints),
            [
                Remedy(
                    f"{holder}/torque/{joint}", value, "a torque limit that holds the arm and leaves some to move it"
                )
                for (holder, joint), value in raised.items()
            ],
        )


def _with(limits: Limits | None, holder: str, raised: dict[tuple[str, int], float]) -> Limits | None:
    if limits is None or limits.torque is None:
        return limits
    return replace(limits, torque=tuple(raised.get((holder, joint), own) for joint, own in enumerate(limits.torque)))


def _lighter_payload(problem: PlanningProblem, positions: FloatArray, limit: FloatArray) -> Iterator[Change]:
    """The largest payload that is held. Gravity is affine in its mass: two masses tell all."""
    payload = problem.payload
    if payload is None:
        return
    half, whole = (
        _gravity(problem.robot.with_payload(replace(payload, mass=mass)), positions)
        for mass in (0.5 * payload.mass, payload.mass)
    )
    per_mass = (whole - half) / (0.5 * payload.mass)
    without = whole - payload.mass * per_mass
    felt = np.abs(per_mass) > LEAST_LEVER
    for share in SHARES:
        headroom = share * limit - np.sign(per_mass) * without
        most = float((headroom[felt] / np.abs(per_mass[felt])).min(initial=np.inf))
        if 0.0 < most < payload.mass:
            explanation = "the payload, kg, that is held with torque left to move it"
            yield replace(problem, payload=replace(payload, mass=most)), [Remedy("/payload/mass", most, explanation)]
