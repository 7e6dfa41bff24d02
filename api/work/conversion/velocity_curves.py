"""Velocity limits by position: from schemas to the library's values."""

from __future__ import annotations

from typing import Any

from api.contract.parts import velocity_curves as schemas
from planner.robots import VelocityCurves, VelocityParabola, VelocityTable


def to_velocity_curves(curves: schemas.VelocityCurves) -> VelocityCurves:
    """Make velocity curves."""
    return VelocityCurves(tuple(map(_to_curve, curves.upper)), tuple(map(_to_curve, curves.lower)))


def with_velocity_curves(values: dict[str, Any], curves: schemas.VelocityCurves | None) -> dict[str, Any]:
    """Return the values of limits with velocity curves as the library's, if there are any."""
    own = {name: value for name, value in values.items() if name != "velocity_curves"}
    return own if curves is None else own | {"velocity_curves": to_velocity_curves(curves)}


def _to_curve(curve: schemas.VelocityParabola | schemas.VelocityTable) -> VelocityParabola | VelocityTable:
    if isinstance(curve, schemas.VelocityParabola):
        return VelocityParabola(curve.rate, curve.end, curve.offset)
    return VelocityTable(tuple(curve.positions), tuple(curve.velocities))
