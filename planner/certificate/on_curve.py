"""The parameters of a polyline or spline of the tool at which the samples of a trajectory are, about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray
    from planner.tool_motions.polylines import Polyline
    from planner.tool_motions.pose_splines import PoseSpline

LOOKS = 16
"""Number of points on each piece of a polyline or spline that the first and the last sample are looked for at."""


@dataclass(frozen=True, eq=False)
class OnCurve:
    """A polyline or spline, whose parameter goes evenly with its length, at samples in order along it.

    Attributes:
        curve: The path itself.
        guesses: (N,), the parameters at which the samples are, about: by the length of the way that the tool has gone.
    """

    curve: Polyline | PoseSpline
    guesses: FloatArray

    @classmethod
    def of(cls, curve: Polyline | PoseSpline, points: FloatArray, blended: np.ndarray) -> OnCurve:
        """The curve with guesses for points (N, 3); where an end of it is blended, that is left out."""
        first, last = (
            end if not is_blended else _nearest_half(curve, point, end)
            for end, point, is_blended in zip((0.0, 1.0), points[[0, -1]], blended, strict=True)
        )
        gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        return cls(curve, first + (last - first) * gone / max(float(gone[-1]), np.finfo(float).tiny))

    def nearest(self, _points: FloatArray) -> FloatArray:
        """The parameters (N,) about where the samples are."""
        return self.guesses

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Positions (N, 3), m, and rotations (N, 3, 3) at parameters (N,); None: none is asked."""
        return self.curve.poses(u)


def _nearest_half(curve: Polyline | PoseSpline, point: FloatArray, end: float) -> float:
    """The parameter of a curve that is about nearest to a point (3,), in the half at one end of it."""
    breakpoints = curve.breakpoints
    looks = (breakpoints[:-1, None] + np.diff(breakpoints)[:, None] * np.arange(LOOKS) / LOOKS).ravel()
    looks = looks[np.abs(looks - end) <= 0.5]
    return float(looks[np.linalg.norm(curve.poses(looks)[0] - point, axis=1).argmin()])
