"""The durations of requests, learnt from recent ones: by kind and size, of each client and of all."""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

CHEAP = 0.2
"""The mean time up to which requests are cheap, s: a wait for one or two is short. On a quiet
machine closed-form plans take a few hundredths of it; the rest is for slower and busy ones."""

UNKNOWN = 0.5
"""The assumed duration of a request of an unknown kind, s; it counts only for the requests behind it."""

REMEMBERED = 16
"""The number of durations of a kind that are remembered: enough that a few outliers among them change nothing."""

OUTLIER = 4.0
"""The times the median beyond which a duration counts no more: a time-out, or a machine that was busy for a moment."""

TRIAL_PAUSE = 10.0
"""The time after which a client may send one more request of a kind that its estimate alone would refuse, s.
The estimate may be wrong, and only a request that runs shows that."""

KNOWN_KINDS = 4096
"""The number of kinds of all clients whose durations are remembered; those used last stay."""

KNOWN_KINDS_OF_CLIENT = 64
"""The number of kinds of one client whose durations are remembered; those used last stay."""

KNOWN_CLIENTS = 512
"""The number of clients whose durations are remembered; the latest stay."""


class Kind(NamedTuple):
    """The kind of a task, by which its duration is learnt. It has no text of a client, so that the kinds stay few.

    Attributes:
        family: The name of the task and the cost key that its operation declares.
        size: The number of binary digits of the number of rows and kibibytes.
    """

    family: tuple[Any, ...]
    size: int


class Cost(NamedTuple):
    """The duration of requests of one kind, s.

    Attributes:
        mean: The mean of the recent ones, where outliers count as little as they can.
        deviation: The mean deviation from it.
    """

    mean: float
    deviation: float

    @property
    def most(self) -> float:
        """The time within which most are done, s."""
        return self.mean + 2.0 * self.deviation

    @property
    def is_cheap(self) -> bool:
        """Whether nobody minds waiting for one."""
        return self.mean <= CHEAP


@dataclass
class History:
    """The recent durations of one kind.

    Attributes:
        seconds: The durations, s.
        tried: When a request was let in that they alone would have refused, s on the monotonic clock.
    """

    seconds: deque[float] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    tried: float = -math.inf

    def cost(self, factor: float) -> Cost:
        """Estimate the duration of a request that takes so many times as long; the fewer are known, the less surely."""
        counted = sorted(self.seconds)
        most = OUTLIER * counted[(len(counted) - 1) // 2]  # of two the lower one: the other may be an outlier
        if counted[-1] > most:
            counted = [min(each, most) for each in counted]
        mean = sum(counted) / len(counted)
        deviation = max(sum([abs(each - mean) for each in counted]), mean) / (len(counted) + 1)
        return Cost(factor * mean, factor * deviation)


class Histories:
    """The durations of kinds, up to a number of them: those used last stay."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._kinds: OrderedDict[Kind, History] = OrderedDict()

    def __len__(self) -> int:
        return len(self._kinds)

    def of(self, kind: Kind) -> History:
        """Give the history of a kind, which may be empty."""
        history = self._kinds.setdefault(kind, History())
        self._kinds.move_to_end(kind)
        if len(self._kinds) > self._most:
            self._kinds.popitem(last=False)
        return history

    def expected(self, kind: Kind) -> Cost | None:
        """Estimate the duration of a request, in proportion to known sizes; None: nothing is known."""
        if kind in self._kinds and self._kinds[kind].seconds:
            return self._kinds[kind].cost(1.0)
        known = [other for other, history in self._kinds.items() if other.family == kind.family and history.seconds]
        if not known:
            return None
        near = min(known, key=lambda other: abs(other.size - kind.size))
        return self._kinds[near].cost(2.0 ** (kind.size - near.size))


class Costs:
    """The durations learnt so far. A client's own requests predict its next one better than the requests of all."""

    def __init__(self) -> None:
        self._of_all = Histories(KNOWN_KINDS)
        self._of_client: OrderedDict[str, Histories] = OrderedDict()

    def expected(self, kind: Kind, client: str = "") -> Cost | None:
        """Estimate the duration of a request, if possible from its client's own; None: nothing is known."""
        own = self._of_client.get(client)
        return (own and own.expected(kind)) or self._of_all.expected(kind)

    def learn(self, kind: Kind, seconds: float, client: str = "", is_bound: bool = False) -> None:
        """Take note of the duration of a request; `is_bound`: it ended early, and may take longer."""
        for histories in (self._own(client), self._of_all):
            expected = histories.expected(kind) if is_bound else None
            if expected is None or expected.mean < seconds:
                histories.of(kind).seconds.append(seconds)

    def claim_trial(self, kind: Kind, client: str, now: float) -> bool:
        """Tell whether a request may run against its estimate, and note that it does: seldom, and one at a time."""
        history = self._own(client).of(kind)
        if now < history.tried + TRIAL_PAUSE:
            return False
        history.tried = now
        return True

    def _own(self, client: str) -> Histories:
        own = self._of_client.setdefault(client, Histories(KNOWN_KINDS_OF_CLIENT))
        self._of_client.move_to_end(client)
        if len(self._of_client) > KNOWN_CLIENTS:
            self._of_client.popitem(last=False)
        return own
