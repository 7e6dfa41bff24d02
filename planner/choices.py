"""The choices among the options of goal sets, with the reasons."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class OptionOutcome:
    """The outcome of one option of a goal set.

    Attributes:
        status: `chosen`: the plan has it. `longer`: its estimated duration is longer, or equal and it comes later.
            `refused`: it has no plan, see `code`. `untried`: the time or the attempts ended before.
        estimated_duration: Estimated duration of the whole trajectory with this option, s, at the limits of velocity
            and acceleration and with straight free motions. The other goal sets have their chosen options. None: the
            option is refused.
        code: Kind of the refusal, as of a `PlanningError`; None: no refusal.
        message: Reason of the refusal, for a person; None: no refusal.

    Examples:
        >>> import planner
        >>> planner.OptionOutcome("longer", estimated_duration=2.5).code is None
        True
    """

    status: Literal["chosen", "longer", "refused", "untried"]
    estimated_duration: float | None = None
    code: str | None = None
    message: str | None = None


@dataclass(frozen=True)
class Choice:
    """The choice at one goal set.

    Attributes:
        waypoint: Index of the goal set in the request.
        option: Index of the chosen option; None: all options are refused.
        first: Index of the first waypoint of the chosen option in the list with the chosen options.
        last: Index of its last waypoint there, which is the goal.
        options: The outcome of each option.

    Examples:
        >>> import planner
        >>> choice = planner.Choice(1, 0, 1, 1, (planner.OptionOutcome("chosen", 2.5),))
        >>> choice.options[choice.option].status
        'chosen'
    """

    waypoint: int
    option: int | None
    first: int
    last: int
    options: tuple[OptionOutcome, ...]
