"""The quantities that limits are put on, what a back end promises about each, and the motion asked at the ends."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.spatial import FloatArray


class Guarantee(StrEnum):
    """What a back end promises about a quantity."""

    HARD = "hard"
    """The limit is kept, or the request is refused."""
    REPORTED = "reported"
    """The certificate reports it; the limit may be exceeded."""


QUANTITIES = (
    "position",
    "velocity",
    "acceleration",
    "jerk",
    "torque",
    "tcp_linear_velocity",
    "tcp_angular_velocity",
)
"""Everything that a limit can be put on, in the order of the certificate."""


ALL_HARD: Mapping[str, Guarantee] = dict.fromkeys(QUANTITIES, Guarantee.HARD)
"""Every limit kept."""


@dataclass(frozen=True, eq=False)
class EndStates:
    """How a trajectory begins and ends; each (joints,), rad or m by s and s^2. It never ends with an acceleration."""

    initial_velocity: FloatArray
    initial_acceleration: FloatArray
    final_velocity: FloatArray

    @property
    def starts_moving(self) -> bool:
        """Whether there is any motion at the first waypoint."""
        return bool(self.initial_velocity.any() or self.initial_acceleration.any())

    @property
    def ends_moving(self) -> bool:
        """Whether there is any motion at the last waypoint."""
        return bool(self.final_velocity.any())


@runtime_checkable
class MovesAtItsEnds(Protocol):
    """A back end whose trajectory may begin and end in motion, as asked by these options; None: at rest."""

    initial_velocity: tuple[float, ...] | None
    initial_acceleration: tuple[float, ...] | None
    final_velocity: tuple[float, ...] | None


END_OPTIONS = ("initial_velocity", "initial_acceleration", "final_velocity")
"""Of a back end that moves at its ends."""


def end_states(backend: object, joints: int) -> EndStates:
    """What a back end's options ask at the ends; rest, where it has none."""
    asked = [getattr(backend, name) if isinstance(backend, MovesAtItsEnds) else None for name in END_OPTIONS]
    return EndStates(*(np.zeros(joints) if rates is None else np.array(rates) for rates in asked))
