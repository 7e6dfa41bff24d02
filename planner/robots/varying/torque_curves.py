"""Torque limits of a joint that depend on its speed: piecewise linear curves, and their values for whole arms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner.spatial import FloatArray

LEAST_TORQUE = 1e-6
"""Least torque on a curve, N m or N, as in all limits of joints."""

MOST_POINTS_OF_CURVE = 64
"""Number of points that a curve may have."""


@dataclass(frozen=True)
class TorqueCurve:
    """A limit of |torque| by speed, linear between the points and constant beyond the first and the last one.

    Attributes:
        speeds: Ascending, not negative, rad/s or m/s.
        torques: The limits there, positive and nowhere ascending, N m or N.

    Examples:
        >>> import planner
        >>> weaker = planner.TorqueCurve(speeds=(1.0, 3.0), torques=(150.0, 60.0))
        >>> robot = planner.load_robot("ur5e").derived(limits={"shoulder_pan_joint": {"torque_curve": weaker}})
        >>> robot.joints[0].torque_curve.torques
        (150.0, 60.0)
    """

    speeds: tuple[float, ...]
    torques: tuple[float, ...]

    def at(self, speeds: FloatArray) -> FloatArray:
        """Return the limits at speeds of any shape."""
        return np.interp(speeds, self.speeds, self.torques)

    def exceeds(self, other: TorqueCurve) -> bool:
        """Tell whether this curve is above another one at any speed."""
        speeds = np.union1d(self.speeds, other.speeds)
        return bool((self.at(speeds) > other.at(speeds) * (1.0 + 1e-9)).any())


@dataclass(frozen=True, eq=False)
class TorqueCurves:
    """The torque curves of all joints, as pieces: the limit is `torque` - `slope` (speed - `speed`) from `speed` on.

    Each array is (joints, pieces), and the first piece begins at rest. Pieces that a joint does not need begin at an
    infinite speed; a joint without a curve has an infinite torque.
    """

    speed: FloatArray
    torque: FloatArray
    slope: FloatArray

    @classmethod
    def of(cls, curves: Sequence[TorqueCurve | None]) -> TorqueCurves:
        """Return the pieces of the curves of joints; None: a joint has no curve."""
        rows = [list(_pieces(curve)) for curve in curves]
        most = max(map(len, rows))
        padded = np.array([own + [(np.inf, own[-1][1], 0.0)] * (most - len(own)) for own in rows])
        return cls(*np.moveaxis(padded, 2, 0))

    @property
    def ends(self) -> FloatArray:
        """The speeds (joints, pieces) at which the pieces end."""
        return np.append(self.speed[:, 1:], np.full((len(self.speed), 1), np.inf), axis=1)

    @property
    def intercepts(self) -> FloatArray:
        """The limits (joints, pieces) of the lines of the pieces at rest."""
        return np.asarray(self.torque + self.slope * np.where(np.isfinite(self.speed), self.speed, 0.0))

    def at(self, speeds: FloatArray) -> FloatArray:
        """Return the limits at speeds (..., joints)."""
        limits = np.empty_like(speeds)
        for joint, (begin, torque, slope) in enumerate(zip(self.speed, self.torque, self.slope, strict=True)):
            own = np.maximum(np.searchsorted(begin, speeds[..., joint], side="right") - 1, 0)
            limits[..., joint] = torque[own] - slope[own] * (speeds[..., joint] - begin[own])
        return limits


def _pieces(curve: TorqueCurve | None) -> Iterator[tuple[float, float, float]]:
    """Yield the first speed, the torque there and the slope of each piece of a curve."""
    if curve is None:
        yield 0.0, np.inf, 0.0
        return
    if curve.speeds[0] > 0.0:
        yield 0.0, curve.torques[0], 0.0
    slopes = [*(-np.diff(curve.torques) / np.diff(curve.speeds)).tolist(), 0.0]
    yield from zip(curve.speeds, curve.torques, slopes, strict=True)


def torque_curve_faults(curve: TorqueCurve) -> Iterator[str]:
    """Yield the faults of a curve."""
    if len(curve.speeds) != len(curve.torques) or not 2 <= len(curve.speeds) <= MOST_POINTS_OF_CURVE:
        yield f"it must have 2 to {MOST_POINTS_OF_CURVE} speeds, and as many torques"
    elif not np.isfinite((curve.speeds, curve.torques)).all():
        yield "its numbers must be finite"
    elif not (np.diff(curve.speeds) > 0.0).all() or curve.speeds[0] < 0.0:
        yield "its speeds must ascend and not be negative"
    elif (np.diff(curve.torques) > 0.0).any() or not curve.torques[-1] >= LEAST_TORQUE:
        yield f"its torques must be at least {LEAST_TORQUE:g} and must not grow with the speed"
