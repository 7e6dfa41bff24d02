"""Faults of payloads and of their tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.limits import SMALLEST, TOO_SMALL

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.fields import FieldPath
    from planner.limits import Limits
    from planner.robots import Robot
    from planner.robots.payload import Payload

ALONE = "must be left out with payload tolerances: they count only in limits of torque"
"""The message of a fault where another limit depends on the payload."""


def payload_faults(payload: Payload, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
    """Find a mass that is too small, and tolerances with which the payload would be no body.

    Args:
        payload: The payload.
        field: Path of the field that has it.
    """
    if not payload.mass >= SMALLEST:
        yield (*field, "mass"), TOO_SMALL
    if not 0.0 <= payload.mass_tolerance <= payload.mass:
        text = f"must be from 0 to the mass, {payload.mass:g} kg; got {payload.mass_tolerance:g}"
        yield (*field, "mass_tolerance"), text
    for i, reach in enumerate(payload.center_of_mass_tolerance):
        if not 0.0 <= reach < np.inf:
            yield (*field, "center_of_mass_tolerance", i), f"must be finite and not negative; got {reach:g}"
    if not 0.0 <= payload.inertia_tolerance <= 1.0:
        yield (*field, "inertia_tolerance"), f"must be from 0 to 1; got {payload.inertia_tolerance:g}"


def tolerance_faults(robot: Robot, requested: Iterable[Limits]) -> Iterator[tuple[FieldPath, str]]:
    """Find limits that depend on the payload, and whose certificate would be of the given payload alone."""
    names = ("power", "total_power", "rms_torque")
    found = {name for limits in requested for name in names if getattr(limits, name) is not None}
    yield from ((("limits", name), ALONE) for name in names if name in found)
    if robot.torque_curves is not None or np.isfinite(robot.limit("rms_torque")).any():
        text = f"{robot.id} has torque curves or RMS torque limits, which count only for a payload without tolerances"
        yield ("payload",), text
