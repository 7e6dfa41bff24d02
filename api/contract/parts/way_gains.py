"""Answers about ways that were made better."""

from __future__ import annotations

from typing import Literal

from api.contract.parts.common import Answer


class WayGain(Answer):
    """What was gained by making a way around better."""

    objective: Literal["duration", "effort", "path_length"]
    """What it was made better by: the `optimise` of the request."""
    first: float
    """The value of the whole trajectory with the way that was found first: its duration, s, its effort, s, or the
    length of its path, rad."""
    last: float
    """The value of the trajectory that is answered, in the same unit (s or rad) and no larger."""
    candidates: int
    """The number of other ways that were timed."""
    checks: int
    """The number of motions that were looked at for them."""
