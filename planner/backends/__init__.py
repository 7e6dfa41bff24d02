"""The back ends: one file and one line here each."""

from planner.backends.auto import Auto
from planner.backends.base import QUANTITIES, BackEnd, Guarantee
from planner.backends.cubic import Cubic
from planner.backends.jerk_limited_joints import Ruckig
from planner.backends.minimum_effort import MinimumEffort
from planner.backends.quintic import Quintic
from planner.backends.time_optimal import TimeOptimal
from planner.backends.trapezoidal import Trapezoidal

BACKENDS: dict[str, type[BackEnd]] = {
    backend.kind: backend
    for backend in (
        Cubic,
        Quintic,
        Trapezoidal,
        Ruckig,
        TimeOptimal,
        MinimumEffort,
        Auto,
    )
}
"""Every back end by its kind."""

__all__ = [
    "BACKENDS",
    "QUANTITIES",
    "Auto",
    "BackEnd",
    "Cubic",
    "Guarantee",
    "MinimumEffort",
    "Quintic",
    "Ruckig",
    "TimeOptimal",
    "Trapezoidal",
]
