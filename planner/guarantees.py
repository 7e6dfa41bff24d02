"""Limited quantities, the guarantees of a back end for each, and the requested motion at the ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, TypeGuard

import numpy as np

from planner.spatial import FloatArray


class Guarantee(StrEnum):
    """A promise that a back end makes about a quantity."""

    HARD = "hard"
    """The limit is kept, or the request is refused."""
    REPORTED = "reported"
    """The certificate reports it; the limit may be exceeded."""


JOINT_DERIVATIVES = ("position", "velocity", "acceleration", "jerk")
"""Names of a joint's position and of its derivatives by time, by their order."""

TCP_ORDERS = {
    "tcp_linear_velocity": 1,
    "tcp_angular_velocity": 1,
    "tcp_linear_acceleration": 2,
    "tcp_angular_acceleration": 2,
    "tcp_centripetal_acceleration": 2,
    "tcp_linear_jerk": 3,
    "tcp_angular_jerk": 3,
}
"""The quantities of the tool that may be limited, with the order of derivative by time that each is."""

QUANTITIES = (*JOINT_DERIVATIVES, "torque", *TCP_ORDERS)
"""All quantities that can be limited, in the order of the certificate."""

JERKS = frozenset({"jerk", *(name for name, order in TCP_ORDERS.items() if order > 2)})
"""The quantities that have no bound where an acceleration jumps."""

ALL_HARD: Mapping[str, Guarantee] = dict.fromkeys(QUANTITIES, Guarantee.HARD)
"""The guarantees of a back end that keeps every limit."""

ALL_BUT_JERK: Mapping[str, Guarantee] = {**ALL_HARD, **dict.fromkeys(JERKS, Guarantee.REPORTED)}
"""The guarantees of a back end whose accelerations may jump."""


@dataclass(frozen=True)
class Capabilities:
    """The capabilities of a back end beyond straight joint motions from rest to rest.

    Attributes:
        passes_with_velocities: The back end passes waypoints with requested velocities.
        moves_at_its_ends: Its trajectory may begin and end in motion, by the options of `MovesAtItsEnds`.
        leaves_straight_motions: The back end may leave the straight joint motion between two stops, within the options
            of `LeavesStraightMotions`.
        is_shaped_by_duration: With a longer duration the back end computes another path, not the same path at a lower
            speed.
        searches: The back end starts from a motion within all limits and searches for a better one, with the methods of
            `planner.backends.base.Searching`.
    """

    passes_with_velocities: bool = False
    moves_at_its_ends: bool = False
    leaves_straight_motions: bool = False
    is_shaped_by_duration: bool = False
    searches: bool = False


class HasCapabilities(Protocol):
    """A back end as far as this module knows it."""

    @property
    def capabilities(self) -> Capabilities:
        """The capabilities of the back end."""
        ...


@dataclass(frozen=True, eq=False)
class EndStates:
    """The motion at the first and at the last waypoint of a trajectory; that of a plan never ends with an acceleration.

    Attributes:
        initial_velocity: Velocity (joints,) at the first waypoint, rad/s or m/s.
        initial_acceleration: Acceleration (joints,) at the first waypoint, rad/s^2 or m/s^2.
        final_velocity: Velocity (joints,) at the last waypoint, rad/s or m/s.
        final_acceleration: Acceleration (joints,) at the last waypoint, or of all joints, rad/s^2 or m/s^2.
    """

    initial_velocity: FloatArray
    initial_acceleration: FloatArray
    final_velocity: FloatArray
    final_acceleration: FloatArray | float = 0.0

    @property
    def starts_moving(self) -> bool:
        """Whether there is any motion at the first waypoint."""
        return bool(self.initial_velocity.any() or self.initial_acceleration.any())

    @property
    def ends_moving(self) -> bool:
        """Whether there is any motion at the last waypoint."""
        return bool(self.final_velocity.any())


class MovesAtItsEnds(HasCapabilities, Protocol):
    """A back end whose trajectory may begin and end in motion, as these options request; None: at rest."""

    initial_velocity: tuple[float, ...] | None
    initial_acceleration: tuple[float, ...] | None
    final_velocity: tuple[float, ...] | None


class LeavesStraightMotions(HasCapabilities, Protocol):
    """A back end that is free to leave the straight joint motion between two stops, by so much; None: by any way.

    The tool may go that far, m, and so may each joint, rad or m.
    """

    max_deviation: float | None
    max_joint_deviation: float | None


END_OPTIONS = ("initial_velocity", "initial_acceleration", "final_velocity")
"""Names of the options of a back end whose trajectory may begin and end in motion, in the order of `EndStates`."""

RAMP_OPTIONS = ("acceleration_time", "deceleration_time")
"""Names of the options of a back end that give the times of acceleration and of braking."""


def moves_at_its_ends(backend: HasCapabilities) -> TypeGuard[MovesAtItsEnds]:
    """Tell whether a back end has the options of motion at its ends."""
    return backend.capabilities.moves_at_its_ends


def leaves_straight_motions(backend: HasCapabilities) -> TypeGuard[LeavesStraightMotions]:
    """Tell whether a back end may leave the straight joint motion between two stops."""
    return backend.capabilities.leaves_straight_motions


def end_states(backend: HasCapabilities, joints: int) -> EndStates:
    """Read the motion at the ends from the options of a back end; one without such options is at rest."""
    if not moves_at_its_ends(backend):
        return EndStates(*np.zeros((3, joints)))
    requested = (backend.initial_velocity, backend.initial_acceleration, backend.final_velocity)
    return EndStates(*(np.zeros(joints) if rates is None else np.array(rates) for rates in requested))
