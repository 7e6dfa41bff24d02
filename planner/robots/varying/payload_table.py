"""Acceleration and jerk limits that fall with the payload, as the controllers of makers have them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

LEAST_PAYLOAD_FACTOR = 1e-6
"""Least factor in a table."""

MOST_PAYLOAD_MASSES = 64
"""Number of masses that a table may have."""


@dataclass(frozen=True)
class PayloadTable:
    """Factors on a robot's acceleration and jerk limits by the payload mass.

    They are linear between the masses and constant beyond the first and the last one, and never grow with the mass.

    Attributes:
        masses: Ascending, not negative, kg.
        acceleration: The factors on all acceleration limits at these masses, up to 1.
        jerk: The factors on all jerk limits; None: 1 at all masses.

    Examples:
        >>> import planner
        >>> gentler = planner.PayloadTable(masses=(1.0, 5.0), acceleration=(1.0, 0.4), jerk=(1.0, 0.2))
        >>> planner.load_robot("ur5e").derived(payload_table=gentler).payload_table.factor("acceleration", 3.0)
        0.7
    """

    masses: tuple[float, ...]
    acceleration: tuple[float, ...]
    jerk: tuple[float, ...] | None = None

    def factor(self, quantity: str, mass: float) -> float:
        """Return the factor on the limits of a quantity of the joints at a payload mass, kg."""
        factors = {"acceleration": self.acceleration, "jerk": self.jerk}.get(quantity)
        return 1.0 if factors is None else float(np.interp(mass, self.masses, factors))

    def exceeds(self, other: PayloadTable) -> bool:
        """Tell whether this table allows more than another one at any mass."""
        masses = np.union1d(self.masses, other.masses).tolist()
        return any(
            self.factor(quantity, mass) > other.factor(quantity, mass) * (1.0 + 1e-9)
            for quantity in ("acceleration", "jerk")
            for mass in masses
        )


def payload_table_faults(table: PayloadTable) -> Iterator[str]:
    """Yield the faults of a table."""
    columns = {"acceleration": table.acceleration, "jerk": table.jerk}
    if not 2 <= len(table.masses) <= MOST_PAYLOAD_MASSES:
        yield f"it must have 2 to {MOST_PAYLOAD_MASSES} masses"
    elif not np.isfinite(table.masses).all() or not (np.diff(table.masses) > 0.0).all() or table.masses[0] < 0.0:
        yield "its masses must ascend and not be negative"
    for name, factors in columns.items():
        if factors is None:
            continue
        if len(factors) != len(table.masses):
            yield f"it must have as many factors of {name} as masses"
        elif not (np.diff(factors) <= 0.0).all() or not LEAST_PAYLOAD_FACTOR <= factors[-1] <= factors[0] <= 1.0:
            yield f"its factors of {name} must be {LEAST_PAYLOAD_FACTOR:g} to 1 and must not grow with the mass"
