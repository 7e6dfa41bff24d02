"""Limits by position and by speed: from schemas to the library's values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from api.contract.parts import limit_curves as schemas
from planner.robots import PayloadTable, TorqueCurve, VelocityCurves, VelocityParabola, VelocityTable

if TYPE_CHECKING:
    from api.contract.parts import payload_table
    from api.contract.parts.joints import DhJoint, OwnLimits


def to_velocity_curves(curves: schemas.VelocityCurves) -> VelocityCurves:
    """Make velocity curves."""
    return VelocityCurves(tuple(map(_to_curve, curves.upper)), tuple(map(_to_curve, curves.lower)))


def to_torque_curve(curve: schemas.TorqueCurve) -> TorqueCurve:
    """Make a torque curve."""
    return TorqueCurve(tuple(curve.speeds), tuple(curve.torques))


def to_payload_table(table: payload_table.PayloadTable | None) -> PayloadTable | None:
    """Make a payload table, if there is one."""
    if table is None:
        return None
    jerk = None if table.jerk is None else tuple(table.jerk)
    by_speed = table.acceleration_at_speeds, table.jerk_at_speeds
    rows = (None if own is None else tuple(map(tuple, own)) for own in by_speed)
    return PayloadTable(tuple(table.masses), tuple(table.acceleration), jerk, tuple(table.speeds or ()), *rows)


def with_curves(values: dict[str, Any], limits: DhJoint | OwnLimits) -> dict[str, Any]:
    """Return the values of limits with their curves, if there are any, as the library's."""
    own = {name: value for name, value in values.items() if name not in ("velocity_curves", "torque_curve")}
    if limits.velocity_curves is not None:
        own["velocity_curves"] = to_velocity_curves(limits.velocity_curves)
    if limits.torque_curve is not None:
        own["torque_curve"] = to_torque_curve(limits.torque_curve)
    return own


def _to_curve(curve: schemas.VelocityParabola | schemas.VelocityTable) -> VelocityParabola | VelocityTable:
    if isinstance(curve, schemas.VelocityParabola):
        return VelocityParabola(curve.rate, curve.end, curve.offset)
    return VelocityTable(tuple(curve.positions), tuple(curve.velocities))
