"""Poses to which the guides of proofs lead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.proofs.checker import Model, Motion

if TYPE_CHECKING:
    from planner.spatial import FloatArray


def constant(x: float) -> Model:
    """Return the Taylor model of a number."""
    return (x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def pose_at(guide: dict[str, Any], u: float) -> tuple[FloatArray, FloatArray]:
    """Return position (3,) and rotation (3, 3) to which a guide leads at a share of its path."""
    joints = [constant(float(np.polyval([*rates[::-1], 0.0], u))) for rates in guide["rates"]]
    point, rotation = Motion(guide, joints).tool()
    return np.array([x[0] for x in point]), np.array([x[0] for x in rotation]).reshape(3, 3)
