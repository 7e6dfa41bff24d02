"""The loads of a robot: its payload, factors on its limits by the mass, and the force that the tool exerts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from planner.spatial import FloatArray, Pose


@dataclass(frozen=True)
class Payload:
    """A body carried at the robot's tip frame (the flange, whatever the tool).

    With tolerances it stands for every body within them, and torque limits hold for all of these bodies.

    Attributes:
        mass: Mass, kg.
        center_of_mass: Center of mass in the tip frame, m.
        inertia: Principal moments (ixx, iyy, izz) about the centre of mass, kg m^2.
        mass_tolerance: Largest difference of the mass from `mass`, kg.
        center_of_mass_tolerance: Half the sizes (x, y, z), m, of a box about `center_of_mass` with the centre of mass.
        inertia_tolerance: Largest difference of each moment from `inertia`, as a share of it.
    """

    mass: float
    center_of_mass: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mass_tolerance: float = 0.0
    center_of_mass_tolerance: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia_tolerance: float = 0.0

    @property
    def has_tolerances(self) -> bool:
        """Whether it stands for more than one body."""
        return any((self.mass_tolerance, *self.center_of_mass_tolerance, self.inertia_tolerance))

    @property
    def largest_mass(self) -> float:
        """The largest mass within the tolerance, kg."""
        return self.mass + self.mass_tolerance


LEAST_PAYLOAD_FACTOR = 1e-6
"""Least factor in a table."""

MOST_PAYLOAD_MASSES = 64
"""Number of masses that a table may have."""

MOST_PAYLOAD_SPEEDS = 64
"""Number of speeds that a table may have."""


@dataclass(frozen=True)
class PayloadTable:
    """Factors on a robot's acceleration and jerk limits by the payload mass, and by the speed of each joint.

    They are linear between the masses and constant beyond the first and the last one, and never grow with the mass. The
    same holds for speeds.

    Attributes:
        masses: Ascending, not negative, kg.
        acceleration: The factors on all acceleration limits at these masses, up to 1.
        jerk: The factors on all jerk limits; None: 1 at all masses.
        speeds: Ascending shares of a joint's velocity limit, from 0 to 1, for factors by speed; empty: there are none.
        acceleration_at_speeds: Further factors on the acceleration limit of a joint, up to 1. Each mass has a row, and
            each speed a column; None: 1 everywhere.
        jerk_at_speeds: The same of jerk limits.

    Examples:
        >>> import planner
        >>> gentler = planner.PayloadTable(masses=(1.0, 5.0), acceleration=(1.0, 0.4), jerk=(1.0, 0.2))
        >>> planner.load_robot("ur5e").derived(payload_table=gentler).payload_table.factor("acceleration", 3.0)
        0.7
    """

    masses: tuple[float, ...]
    acceleration: tuple[float, ...]
    jerk: tuple[float, ...] | None = None
    speeds: tuple[float, ...] = ()
    acceleration_at_speeds: tuple[tuple[float, ...], ...] | None = None
    jerk_at_speeds: tuple[tuple[float, ...], ...] | None = None

    def factor(self, quantity: str, mass: float) -> float:
        """Return the factor on the limits of a quantity of the joints at a payload mass, kg, at all speeds."""
        factors = {"acceleration": self.acceleration, "jerk": self.jerk}.get(quantity)
        return 1.0 if factors is None else float(np.interp(mass, self.masses, factors))

    def at_speeds(self, quantity: str, mass: float) -> tuple[float, ...] | None:
        """Return the factors on the limits of a quantity at `speeds`, with a payload mass, kg; None: 1."""
        rows = {"acceleration": self.acceleration_at_speeds, "jerk": self.jerk_at_speeds}[quantity]
        if rows is None:
            return None
        return tuple(float(np.interp(mass, self.masses, column)) for column in zip(*rows, strict=True))

    def exceeds(self, other: PayloadTable) -> bool:
        """Tell whether this table allows more than another one at any mass and speed."""
        masses = np.union1d(self.masses, other.masses).tolist()
        speeds = np.union1d(self.speeds, other.speeds)

        def allowed(table: PayloadTable, quantity: str, mass: float) -> FloatArray:
            factors, shares = table.at_speeds(quantity, mass), np.ones(max(len(speeds), 1))
            if factors is not None:
                shares = np.interp(speeds, table.speeds, factors)
            return table.factor(quantity, mass) * shares

        return any(
            (allowed(self, quantity, mass) > allowed(other, quantity, mass) * (1.0 + 1e-9)).any()
            for quantity in ("acceleration", "jerk")
            for mass in masses
        )


def payload_table_faults(table: PayloadTable) -> Iterator[str]:
    """Yield the faults of a table."""
    columns = {"acceleration": table.acceleration, "jerk": table.jerk}
    by_speed = {"acceleration_at_speeds": table.acceleration_at_speeds, "jerk_at_speeds": table.jerk_at_speeds}
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
    speeds, is_by_speed = np.array(table.speeds), any(rows is not None for rows in by_speed.values())
    ascends = bool((np.diff(speeds, prepend=-1.0, append=2.0) > 0.0).all() and (speeds >= 0.0).all())
    if is_by_speed and not (ascends and 2 <= len(speeds) <= MOST_PAYLOAD_SPEEDS and speeds[-1] <= 1.0):
        yield f"it must have 2 to {MOST_PAYLOAD_SPEEDS} speeds that ascend, from 0 or more to 1 or less"
    for name, rows in by_speed.items():
        if rows is None:
            continue
        if len(rows) != len(table.masses) or any(len(row) != len(table.speeds) for row in rows):
            yield f"its `{name}` must have a row for each mass, with a factor for each speed"
            continue
        values = np.array(rows)
        grows = (np.diff(values, axis=0) > 0.0).any() or (np.diff(values, axis=1) > 0.0).any()
        if grows or not LEAST_PAYLOAD_FACTOR <= values.min() <= values.max() <= 1.0:
            text = f"must be {LEAST_PAYLOAD_FACTOR:g} to 1 and must not grow with the mass or the speed"
            yield f"the factors of its `{name}` {text}"


Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class ProcessForce:
    """A constant force and moment that the tool exerts on the workpiece, at the tool centre point.

    The joints need the torques J^T (force, moment) for it, in addition to the torques of the motion.

    Attributes:
        force: (3,), N.
        moment: (3,), N m.
        frame: The axes of both: the tool's, which turn with it, or the base's.
    """

    force: Vector3 = (0.0, 0.0, 0.0)
    moment: Vector3 = (0.0, 0.0, 0.0)
    frame: Literal["tool", "base"] = "tool"

    def __post_init__(self) -> None:
        """Keep plain numbers, which are compared and cannot change."""
        for name in ("force", "moment"):
            x, y, z = map(float, getattr(self, name))
            object.__setattr__(self, name, (x, y, z))

    @property
    def is_finite(self) -> bool:
        """Whether all numbers are finite."""
        return bool(np.isfinite([*self.force, *self.moment]).all())

    def on_chain(self, tool: pin.Frame) -> FloatArray:
        """Return the numbers of `SerialChain.load` after free fall, for the frame of a tool."""
        in_base = self.frame == "base"
        axes = np.eye(3) if in_base else tool.placement.rotation
        vectors = [axes @ np.array(vector) for vector in (self.force, self.moment)]
        return np.hstack([*vectors, tool.placement.translation, tool.parentJoint - 1, in_base])

    def from_frame(self, frame: Pose) -> ProcessForce:
        """Turn a process force given in the axes of a frame, such as a work object's, to the base's axes.

        Args:
            frame: Pose of the frame in the base frame; without a rotation, its axes are the base's.
        """
        rotation = np.eye(3) if frame.rotation is None else frame.rotation
        force, moment = (rotation @ np.array([self.force, self.moment]).T).T
        return ProcessForce(tuple(force), tuple(moment), "base")
