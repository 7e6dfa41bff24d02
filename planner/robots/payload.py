"""The payload of a robot."""

from __future__ import annotations

from dataclasses import dataclass


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
