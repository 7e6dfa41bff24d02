"""Higher limits of a problem, as far as a motion needs them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import prod
from typing import Any

from planner.errors import Remedy
from planner.fields import FieldPath
from planner.limits import JOINT_QUANTITIES, Limits, SegmentLimits
from planner.planning.attempts import Attempt
from planner.planning.proofs import Change
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
