"""Lower and upper limits of a quantity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.spatial import FloatArray


class Bounds(NamedTuple):
    """The lower and upper limits of one quantity, both (..., joints); infinite: none.

    Attributes:
        lower: Lower limits, negative except for positions.
        upper: Upper limits, positive except for positions.
    """

    lower: FloatArray
    upper: FloatArray

    @classmethod
    def of_magnitudes(cls, limit: FloatArray) -> Bounds:
        """Return the bounds that limit both directions alike."""
        return cls(-limit, limit)

    @property
    def narrower(self) -> FloatArray:
        """The magnitudes (..., joints) that keep both limits."""
        return np.minimum(-self.lower, self.upper)

    @property
    def is_symmetric(self) -> bool:
        """Whether both directions have the same limits."""
        return bool((self.upper == -self.lower).all())

    @property
    def weights(self) -> FloatArray:
        """The shares (2, ..., joints) that the narrower limit is of the lower and of the upper one, up to 1."""
        magnitudes, narrower = np.abs(self), self.narrower
        limited = np.broadcast_to(np.isfinite(narrower), magnitudes.shape)
        return np.divide(narrower, magnitudes, out=np.ones_like(magnitudes), where=limited)

    @property
    def centred(self) -> tuple[FloatArray, FloatArray]:
        """The middle between the limits, and their distance from there, both (..., joints)."""
        half = (self.upper - self.lower) / 2.0
        middle = np.add(self.lower, self.upper, out=np.zeros_like(half), where=np.isfinite(half)) / 2.0
        return middle, half

    def used(self, rows: np.ndarray, values: FloatArray) -> FloatArray:
        """Return the shares (..., joints) that values (..., joints) use of the limits in rows (...)."""
        return self.of(rows).shares(values)

    def shares(self, values: FloatArray) -> FloatArray:
        """Return the shares (..., joints) that values (..., joints) use of limits that broadcast against them."""
        return np.asarray(values / np.where(values < 0.0, self.lower, self.upper))

    def within(self, others: Bounds | FloatArray) -> Bounds:
        """Return the limits that keep others, too: bounds or magnitudes (..., joints)."""
        lower, upper = others if isinstance(others, Bounds) else (-others, others)
        return Bounds(np.maximum(self.lower, lower), np.minimum(self.upper, upper))

    def at_least(self, magnitudes: FloatArray) -> Bounds:
        """Return the limits widened to magnitudes (..., joints) where they are narrower."""
        return Bounds(np.minimum(self.lower, -magnitudes), np.maximum(self.upper, magnitudes))

    def along(self, travels: FloatArray) -> Bounds:
        """Return the limits that count in the direction of travels (..., joints)."""
        return Bounds(*np.where(travels < 0.0, [-self.upper, -self.lower], self))

    def divided_by(self, factors: FloatArray) -> Bounds:
        """Return the limits divided by positive factors (..., joints)."""
        return Bounds(self.lower / factors, self.upper / factors)

    def of(self, rows: np.ndarray) -> Bounds:
        """Return the limits in some rows, in that order."""
        return Bounds(self.lower[rows], self.upper[rows])


def measures(limits: Sequence[Bounds]) -> tuple[FloatArray, FloatArray | None]:
    """Return the narrower limits (quantities, ..., joints), and the `weights` (2, quantities, ...) if they differ."""
    narrower = np.stack([bounds.narrower for bounds in limits])
    if all(bounds.is_symmetric for bounds in limits):
        return narrower, None
    return narrower, np.stack([bounds.weights for bounds in limits], axis=1)
