"""The back ends: one file and one line here each."""

from planner.backends.auto import Auto
from planner.backends.base import BackEnd
from planner.backends.min_effort.min_effort import MinEffort
from planner.backends.ruckig.ruckig import Ruckig
from planner.backends.splines.cubic import Cubic
from planner.backends.splines.quintic import Quintic
from planner.backends.toppra.toppra import Toppra
from planner.backends.trapezoidal.trapezoidal import Trapezoidal
from planner.guarantees import QUANTITIES, Guarantee

BACKENDS: dict[str, type[BackEnd]] = {
    backend.kind: backend
    for backend in (
        Cubic,
        Quintic,
        Trapezoidal,
        Ruckig,
        Toppra,
        MinEffort,
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
    "MinEffort",
    "Quintic",
    "Ruckig",
    "Toppra",
    "Trapezoidal",
]
