"""Limits of single joints and named positions from the owner of a robot, checked against the robot's own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeGuard

import numpy as np

from planner.robots.checks import (
    DYNAMIC_QUANTITIES,
    LEAST_LIMIT,
    MAX_NAME_LENGTH,
    MAX_NUMBER,
    check_position_limits,
    with_checked_drives,
    with_torque_curve,
    with_velocity_curves,
)
from planner.robots.description import DRIVE_VALUES, RANGED_QUANTITIES, Joint, JointKind
from planner.robots.findings import Findings, shown
from planner.robots.payload import PayloadTable, payload_table_faults
from planner.robots.varying.torque_curves import TorqueCurve
from planner.robots.varying.velocity_curves import VelocityCurves

WIDENABLE = ("default", "estimate")
"""Provenances of limits that an owner may widen: nobody has published them."""

EQUAL_LIMIT_TOLERANCE = 1e-9
"""Relative amount by which a limit may be wider than the robot's own one and count as equal."""


RANGES = {f"{quantity}_range": quantity for quantity in RANGED_QUANTITIES}
"""Names of the pairs of lower and upper limits that an owner may give, and the quantities that they are of."""

CURVES = "velocity_curves"
"""Name of the velocity limits by position that an owner may give."""

TORQUE_CURVE = "torque_curve"
"""Name of the torque limit by speed that an owner may give."""

QUANTITIES = ("lower", "upper", *DYNAMIC_QUANTITIES, "rms_torque", *RANGES, CURVES, TORQUE_CURVE, *DRIVE_VALUES)
"""Names of the values that an owner may give: limits of the position, its derivatives and torque, and drives."""

OwnLimits = Mapping[str, float | Sequence[float] | VelocityCurves | TorqueCurve]
"""Limits of one joint by their names: numbers; pairs of numbers where the names are of `RANGES`; curves."""


def with_own_limits(joints: Sequence[Joint], limits: Mapping[str, OwnLimits], findings: Findings) -> tuple[Joint, ...]:
    """Return the joints with limits of their owner, wider than before only where those before are nobody's figures."""
    names = [joint.name for joint in joints]
    for name in limits:
        if name not in names:
            text = f"there is no joint {shown(name)}; the joints are {', '.join(map(shown, names))}"
            findings.error("unknown_joint", shown(name), text)
    changed = tuple(_with_own_limits(joint, limits.get(joint.name, {}), findings) for joint in joints)
    has_drives = any(name in DRIVE_VALUES for own in limits.values() for name in own)
    return with_checked_drives(changed, findings) if has_drives else changed


def _with_own_limits(joint: Joint, own: OwnLimits, findings: Findings) -> Joint:
    provenance = dict(joint.provenance)
    known: dict[str, Any] = {}
    numbers = {name: value for name, value in own.items() if not isinstance(value, VelocityCurves | TorqueCurve)}
    pairs = {RANGES[name]: value for name, value in numbers.items() if name in RANGES}
    for name, value in numbers.items():
        if name in RANGES:
            continue
        quantity = "position" if name in ("lower", "upper") else name
        if _is_limit(value, name, joint, findings):
            is_limit = name not in DRIVE_VALUES
            known[name] = _narrowed(joint, quantity, name, value, findings) if is_limit else value
            provenance[quantity] = "owner"
    changed = replace(joint, **known, provenance=provenance)
    for quantity, pair in pairs.items():
        changed = _with_range(changed, quantity, pair, findings)
    if "lower" in known or "upper" in known:
        # A continuous joint whose owner limits it, to spare its cables, is a revolute one.
        kind: JointKind = "revolute" if joint.kind == "continuous" else joint.kind
        changed = check_position_limits(replace(changed, kind=kind), findings)
    curves, curve = own.get(CURVES), own.get(TORQUE_CURVE)
    if isinstance(curves, VelocityCurves):
        changed = with_velocity_curves(changed, curves, findings)
    return with_torque_curve(changed, curve, findings) if isinstance(curve, TorqueCurve) else changed


def _with_range(joint: Joint, quantity: str, pair: float | Sequence[float], findings: Findings) -> Joint:
    """Return a joint with limits that differ by direction, within its own limits."""
    name, limits = shown(joint.name), np.ravel(pair).tolist()
    if len(limits) != 2 or not (LEAST_LIMIT <= -limits[0] <= MAX_NUMBER and LEAST_LIMIT <= limits[1] <= MAX_NUMBER):
        text = f"the {quantity} range of {name} needs a lower limit below 0 and an upper one above"
        findings.error("absurd_limit", name, text)
        return joint
    widest = getattr(joint, quantity)
    lower, upper = joint.ranges.get(quantity, (-widest, widest))
    if max(lower, -widest) > limits[0] or min(upper, widest) < limits[1]:
        text = f"the {quantity} range of {name} cannot be wider than {max(lower, -widest):g} to {min(upper, widest):g}"
        findings.error("wider_limit", name, text)
    kept = {**joint.ranges, quantity: (limits[0], limits[1])}
    return replace(joint, ranges=kept, provenance={**joint.provenance, quantity: "owner"})


def _is_limit(value: float | Sequence[float], name: str, joint: Joint, findings: Findings) -> TypeGuard[float]:
    """Tell whether a limit has a known name and is a number that lets the joint move."""
    called = name.replace("_", " ") if name in DRIVE_VALUES else f"{name} limit"
    least = -MAX_NUMBER if name in ("lower", "upper") else 0.0 if name in DRIVE_VALUES else LEAST_LIMIT
    if name not in QUANTITIES:
        text = f"{shown(joint.name)} has no limit called {shown(name)}; there are {', '.join(QUANTITIES)}"
        findings.error("unknown_limit", shown(joint.name), text)
    elif not isinstance(value, float | int):
        text = f"the {called} of {shown(joint.name)} is no number"
        findings.error("absurd_limit", shown(joint.name), text)
    elif not least <= value <= MAX_NUMBER:
        text = f"the {called} of {shown(joint.name)} is {value:g}, not between {least:g} and {MAX_NUMBER:g}"
        findings.error("absurd_limit", shown(joint.name), text)
    else:
        return True
    return False


def _narrowed(joint: Joint, quantity: str, field: str, value: float, findings: Findings) -> float:
    """Return the owner's limit, no wider than the one before unless that is a default or an estimate."""
    before: float = getattr(joint, field)
    beyond = before - value if field == "lower" else value - before
    if not beyond > 0.0:
        return value
    if beyond <= EQUAL_LIMIT_TOLERANCE * max(1.0, abs(before)):
        return before
    origin, name = joint.provenance.get(quantity, "default"), shown(joint.name)
    if origin in WIDENABLE:
        text = f"the {field} limit of {name}, {value:g}, is wider than the {origin} of {before:g} that it replaces"
        findings.warning("limit_widened", name, text)
    else:
        text = f"the {field} limit of {name} cannot be {value:g}: that is wider than the {origin} one, {before:g}"
        findings.error("wider_limit", name, text)
    return value


def is_within(joints: Sequence[Joint], position: Sequence[float]) -> bool:
    """Tell whether a position, one value per joint, is within the position limits."""
    return all(joint.lower <= value <= joint.upper for joint, value in zip(joints, position, strict=True))


def checked_positions(
    joints: Sequence[Joint], named: Mapping[str, Sequence[float]], findings: Findings
) -> dict[str, tuple[float, ...]]:
    """Return the named positions, one value a joint within its position limits."""
    kept = {}
    for name, position in named.items():
        subject = shown(name)
        if not name or len(name) > MAX_NAME_LENGTH or not name.isprintable():
            text = f"a named position needs a printable name of 1 to {MAX_NAME_LENGTH} characters"
            findings.error("invalid_name", subject, text)
        if len(position) != len(joints):
            text = f"the position {subject} has {len(position)} values for {len(joints)} joints"
            findings.error("wrong_number_count", subject, text)
            continue
        for joint, value in zip(joints, position, strict=True):
            if not joint.lower <= value <= joint.upper or not math.isfinite(value):
                text = f"in the position {subject}, {shown(joint.name)} is at {value:g}, outside of its position limits"
                findings.error("outside_position_limits", subject, text)
        kept[name] = tuple(float(value) for value in position)
    return kept


def checked_table(own: PayloadTable | None, table: PayloadTable | None, findings: Findings) -> PayloadTable | None:
    """Return the payload table of an owner, nowhere above the robot's own one; None: the robot's own one."""
    if table is None:
        return own
    faults = list(payload_table_faults(table))
    if not faults and own is not None and table.exceeds(own):
        faults.append("it must not allow more than the table that it replaces")
    for fault in faults:
        findings.error("invalid_payload_table", "payload_table", f"payload table: {fault}")
    return table
