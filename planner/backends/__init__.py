"""The back ends: one file and one line here each."""

from planner.backends.base import QUANTITIES, BackEnd, Guarantee
from planner.backends.cubic import Cubic
from planner.backends.jerk_limited_joints import Ruckig
from planner.backends.quintic import Quintic
from planner.backends.trapezoidal import Trapezoidal

BACKENDS: dict[str, type[BackEnd]] = {
    backend.kind: backend
    for backend in (
        Cubic,
        Quintic,
        Trapezoidal,
        Ruckig,
    )
}
"""Every back end by its kind."""

__all__ = ["BACKENDS", "QUANTITIES", "BackEnd", "Cubic", "Guarantee", "Quintic", "Ruckig", "Trapezoidal"]
