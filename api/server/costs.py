"""How long requests take, learnt from those that were answered: by operation, back end and number of waypoints."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

CHEAP = 0.2
"""The mean time up to which requests are cheap, s: those that wait for one or two have not waited for long. On a quiet
machine closed-form plans take a few hundredths of it; the rest is for slower and busy ones."""

UNKNOWN = 0.5
"""The time that a request takes of which nothing is known, s; it counts only for those that wait behind it."""

GAIN_OF_THE_MEAN, GAIN_OF_THE_DEVIATION = 1.0 / 8.0, 1.0 / 4.0
"""The weights of a new measurement, as those of round-trip times in TCP (RFC 6298)."""

KNOWN_FAMILIES = 512
"""The number of families of requests whose times are kept; those that came last go first."""

ROWS = ("waypoints", "poses", "positions", "points")
"""The fields whose length says how much a request asks."""

SLOW_MOTIONS = ("linear", "circular", "polyline", "spline", "free")
"""The kinds of motion that have to be followed with the joints, or sought, which takes most of their request's time."""

LARGEST = 1e6
"""The number of seconds beyond which a budget says nothing: the request will be refused."""


class Kind(NamedTuple):
    """What tells how long a request may take.

    Attributes:
        family: The operation, the back end with the options that are switched on, whether there are slow motions,
            whether ways around are made better, and for how many seconds.
        size: The number of binary digits of the number of waypoints, poses or rows.
    """

    family: tuple[Any, ...]
    size: int


class Cost(NamedTuple):
    """How long requests of one kind take, s.

    Attributes:
        mean: The smoothed mean.
        deviation: The smoothed mean deviation from it.
    """

    mean: float
    deviation: float

    @property
    def most(self) -> float:
        """The time within which all but a few are done, s."""
        return self.mean + 2.0 * self.deviation

    @property
    def is_cheap(self) -> bool:
        """Whether nobody minds waiting for one."""
        return self.mean <= CHEAP


def kind_of(operation: str, document: Mapping[str, Any], index: int = 0) -> Kind:
    """Find the kind of a request, which need not follow its schema; `index` chooses one of its `backends`."""
    backends = document.get("backends")
    backend = backends[index] if isinstance(backends, list) and index < len(backends) else document.get("backend")
    options: tuple[Any, ...] = ()
    if isinstance(backend, dict):
        options = (str(backend.get("kind")), *sorted(name for name, value in backend.items() if value is True))
    waypoints = document.get("waypoints")
    motions = list(map(_motion, waypoints)) if isinstance(waypoints, list) else []
    is_slow = any(motion.get("kind") in SLOW_MOTIONS for motion in motions)
    budgets = [motion.get("time_budget") for motion in motions if motion.get("optimise")]
    seconds = sum(round(budget) for budget in budgets if isinstance(budget, int | float) and 0.0 <= budget < LARGEST)
    rows = (document.get(name) for name in ROWS)
    size = max((len(values) for values in rows if isinstance(values, list)), default=0)
    return Kind((operation, options, is_slow, bool(budgets), seconds), size.bit_length())


def _motion(waypoint: Any) -> Mapping[str, Any]:
    motion = waypoint.get("motion") if isinstance(waypoint, dict) else None
    return motion if isinstance(motion, dict) else {}


class Costs:
    """What has been learnt so far."""

    def __init__(self) -> None:
        self._families: OrderedDict[tuple[Any, ...], dict[int, Cost]] = OrderedDict()

    def expected(self, kind: Kind) -> Cost | None:
        """Tell how long a request takes; None: nothing is known. Those of other sizes take time in proportion."""
        known = self._families.get(kind.family)
        if not known:
            return None
        nearest = min(known, key=lambda size: abs(size - kind.size))
        factor = 2.0 ** (kind.size - nearest)
        return Cost(known[nearest].mean * factor, known[nearest].deviation * factor)

    def learn(self, kind: Kind, seconds: float) -> None:
        """Take note of a request that was answered as asked."""
        known = self._families.setdefault(kind.family, {})
        self._families.move_to_end(kind.family)
        if len(self._families) > KNOWN_FAMILIES:
            self._families.popitem(last=False)
        before = known.get(kind.size)
        if before is None:
            known[kind.size] = Cost(seconds, seconds / 2.0)
        else:
            off = seconds - before.mean
            deviation = before.deviation + GAIN_OF_THE_DEVIATION * (abs(off) - before.deviation)
            known[kind.size] = Cost(before.mean + GAIN_OF_THE_MEAN * off, deviation)

    def learn_at_least(self, kind: Kind, seconds: float) -> None:
        """Take note of a request that was refused or given up after so long: it may take longer, never less."""
        expected = self.expected(kind)
        if expected is None or expected.mean < seconds:
            self.learn(kind, seconds)
