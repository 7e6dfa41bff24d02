"""Higher limits of a problem, as far as a motion needs them; the heaviest payload within the limits of torque."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import prod
from typing import Any

import numpy as np

from planner.dynamics import heaviest_mass
from planner.errors import Remedy
from planner.fields import FieldPath
from planner.limits import JOINT_QUANTITIES, Limits, SegmentLimits
from planner.planning.attempts import Attempt
from planner.planning.proofs import Change
from planner.problems.problem import PlanningProblem
from planner.robots import Robot
from planner.robots.payload import Payload
from planner.spatial import FloatArray
from planner.tolerances import LIMIT_TOLERANCE

Needs = dict[tuple[str, int, int], float]
"""The value that a limit must have, by quantity, segment and joint (of the tool's speeds: 0)."""


def limit_of(limits: SegmentLimits, quantity: str, segment: int, joint: int) -> float:
    """Return the limit in force; for `joint` see `Needs`."""
    return float(limits.magnitudes(quantity)[segment, joint])


def higher_limits(attempt: Attempt, needs: Needs, shares: Sequence[float], explanation: str) -> Iterator[Change]:
    """Raise the requested limits of a problem as far as needed, for each fraction; nothing if insufficient."""
    problem, numbers = attempt.problem, attempt.with_detours.numbers
    requested: dict[FieldPath, Limits] = {("limits",): problem.limits}
    requested |= {
        _field(k): waypoint.limits for k, waypoint in enumerate(problem.waypoints) if waypoint.limits is not None
    }
    for share in shares:
        raised = dict(requested)
        for (quantity, segment, joint), least in needs.items():
            own = float(problem.robot.limit(quantity)[joint]) if quantity in JOINT_QUANTITIES else float("inf")
            if least > own * (1.0 + LIMIT_TOLERANCE):
                return
            own_field = map(_field, numbers[segment + 1 : segment + 2])  # a single waypoint has none
            holders = [holder for holder in (*own_field, ("limits",)) if holder in raised]
            _raise(raised, holders, quantity, joint, min(least / share, own), own)
        if raised == requested:
            return
        yield [
            Remedy((*holder, *field), value, explanation)
            for holder, limits in raised.items()
            for field, value in _differences(vars(requested[holder]), vars(limits))
        ]


def _field(waypoint: int) -> FieldPath:
    return "waypoints", waypoint, "limits"


def _raise(
    limits: dict[FieldPath, Limits], holders: Sequence[FieldPath], quantity: str, joint: int, needed: float, own: float
) -> None:
    """Raise one limit, which holders ask, the narrowest of them holds and the scales of all narrow, in place."""
    scaled, of_joint = f"{quantity}_scale", quantity in JOINT_QUANTITIES
    requested = {holder: value for holder in holders if (value := getattr(limits[holder], quantity)) is not None}
    in_force = min([own, *(value[joint] if of_joint else value for value in requested.values())])
    scales = {holder: getattr(limits[holder], scaled, 1.0) for holder in holders}
    missing = needed / (in_force * prod(scales.values()))
    for holder, scale in scales.items():
        if missing > 1.0 and scale < 1.0:
            changed: dict[str, Any] = {scaled: min(1.0, scale * missing)}
            limits[holder] = replace(limits[holder], **changed)
            missing *= scale / changed[scaled]
    least = min(in_force * missing, own)
    for holder, value in requested.items():
        if missing > 1.0 and (value[joint] if of_joint else value) < least:
            changed = {quantity: (*value[:joint], least, *value[joint + 1 :]) if of_joint else least}
            limits[holder] = replace(limits[holder], **changed)


def _differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[tuple[FieldPath, float]]:
    for name, value in new.items():
        if isinstance(value, tuple):
            for joint, (before, after) in enumerate(zip(old[name], value, strict=True)):
                if after != before:
                    yield (name, joint), after
        elif value != old[name]:
            yield (name,), value


def lighter_payload(
    problem: PlanningProblem,
    torques: Callable[[Robot, np.ndarray], FloatArray],
    segments: np.ndarray,
    limit: FloatArray,
    shares: Sequence[float],
    explanation: str,
) -> Iterator[Change]:
    """Yield payloads as heavy as the limits allow, for each fraction; nothing if no lighter payload suffices.

    Args:
        problem: A problem, with its detours, with or without payloads.
        torques: (M, joints), of a robot with its payload in M states of some motion or at rest, by their mask (N,).
            They are affine in the mass of the payload: two masses tell all.
        segments: (N,), the segment of each state.
        limit: (N, joints).
        shares: Shares of the limit that the torques may take.
        explanation: The explanation of the remedy.
    """
    measured = []
    for field, payload, first, last in _carried(problem):
        rows = (segments >= first) & (segments < last)
        half, whole = (
            torques(problem.robot.with_payload(replace(payload, mass=mass)), rows)
            for mass in (0.5 * payload.mass, payload.mass)
        )
        per_mass = (whole - half) / (0.5 * payload.mass)
        measured.append((field, payload.mass, per_mass, whole - payload.mass * per_mass, limit[rows]))
    for share in shares:
        lighter = []
        for field, mass, per_mass, without, own_limit in measured:
            most = heaviest_mass(without, per_mass, -share * own_limit, share * own_limit)
            if most <= 0.0:
                return
            if most < mass:
                lighter.append(Remedy((*field, "mass"), most, explanation))
        if lighter:
            yield lighter


def _carried(problem: PlanningProblem) -> Iterator[tuple[FieldPath, Payload, int, int]]:
    """Yield the payloads: field, payload, and the segments from the first to before the last."""
    requested: list[tuple[FieldPath, Payload | None, int]] = [(("payload",), problem.payload, 0)]
    for i, waypoint in enumerate(problem.waypoints):
        if waypoint.payload is not None or waypoint.put_down:
            requested.append((("waypoints", problem.numbers[i], "payload"), waypoint.payload, i))
    ends = [first for _, _, first in requested[1:]]
    for (field, payload, first), last in zip(requested, [*ends, len(problem.waypoints)], strict=True):
        if payload is not None and first < last:
            yield field, payload, first, last
