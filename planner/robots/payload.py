"""The payload of a robot."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Payload:
    """A body carried at the robot's tip frame (the flange, whatever the tool).

    Attributes:
        mass: Mass, kg.
        center_of_mass: Center of mass in the tip frame, m.
        inertia: Principal moments (ixx, iyy, izz) about the center of mass, kg m^2.
    """

    mass: float
    center_of_mass: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float] = (0.0, 0.0, 0.0)
