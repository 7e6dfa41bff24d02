"""Limited quantities that are no polynomials of time: their values, their rows for time scaling, and their peaks."""

from planner.constraints.at_speed import ACCELERATION_AT_SPEED, JERK_AT_SPEED, TORQUE_AT_SPEED
from planner.constraints.bounds import Bounds, measures
from planner.constraints.constraint import Constraint, Rows
from planner.constraints.quantities import POWER, TOOL, TORQUE, TOTAL_POWER, VELOCITY_AT_POSITION
from planner.constraints.torque_with_tolerances import TORQUE_WITH_TOLERANCES

OF_FRICTION = (TORQUE, TORQUE_WITH_TOLERANCES)
"""The constraints with rows to which the friction of the joints is added."""

__all__ = [
    "ACCELERATION_AT_SPEED",
    "JERK_AT_SPEED",
    "OF_FRICTION",
    "POWER",
    "TOOL",
    "TORQUE",
    "TORQUE_AT_SPEED",
    "TORQUE_WITH_TOLERANCES",
    "TOTAL_POWER",
    "VELOCITY_AT_POSITION",
    "Bounds",
    "Constraint",
    "Rows",
    "measures",
]
