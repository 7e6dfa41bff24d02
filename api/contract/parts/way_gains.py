"""Answers about better detours."""

from __future__ import annotations

from typing import Literal

from api.contract.parts.common import Answer


class WayGain(Answer):
    """The gain of a better detour."""

    objective: Literal["duration", "effort", "path_length"]
    """The objective: the `optimise` of the request."""
    first: float
    """The value of the whole trajectory with the first detour: its duration, s, its effort, s, or the length of its
    path, rad."""
    last: float
    """The value of the trajectory in the answer, in the same unit (s or rad) and no larger."""
    candidates: int
    """The number of other detours that were timed."""
    checks: int
    """The number of motions that were checked for them."""
