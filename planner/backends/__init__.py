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


def as_backend(value: BackEnd | str) -> BackEnd:
    """Return the back end of this kind with default options; return a back end as it is.

    Raises:
        ValueError: No back end is of this kind.
        TypeError: The value is neither a kind nor a back end.

    Examples:
        >>> import planner
        >>> planner.as_backend("ruckig") == planner.Ruckig()
        True
    """
    if isinstance(value, str):
        if value not in BACKENDS:
            raise ValueError(f"`backend` must be one of {', '.join(BACKENDS)}; got {value!r}")
        return BACKENDS[value]()
    if isinstance(value, type) or not hasattr(value, "parametrize"):
        name = value.__name__ if isinstance(value, type) else type(value).__name__
        hint = f"; write planner.{name}()" if name in __all__ else ""
        raise TypeError(f"`backend` must be a back end or one of {', '.join(BACKENDS)}; got {name}{hint}")
    return value


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
    "as_backend",
]
