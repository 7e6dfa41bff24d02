"""From the schema of a vibration mode to the library's value."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.problems.residual_vibration import ResidualVibration

if TYPE_CHECKING:
    from api.contract.parts.common import VibrationMode


def to_residual_vibration(mode: VibrationMode | None) -> ResidualVibration | None:
    """Make a vibration mode."""
    return None if mode is None else ResidualVibration(**mode.model_dump())
