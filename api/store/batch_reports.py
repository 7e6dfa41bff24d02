"""The figures of a batch's report: sums over all its items, and the worst few.

An index has all values that are summed up and sorted. Only the results that the report shows are read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from sqlalchemy import case, func, select

from api.store.items import PLANNED, Result
from api.store.tables import items

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sqlalchemy import Connection
    from sqlalchemy.sql.elements import ColumnElement

BARS = 20
"""The number of bars of a histogram."""

WORST = 5
"""The number of items of each kind of the worst."""

EXAMPLES = 3
"""The number of examples of each code of a problem."""

LARGEST = 2**18
"""The most bytes of a request and its result, compressed, that are shown; most have a twentieth."""

LEAST_SECONDS = 1e-6
"""The least time that differs from none, s."""


class Spread(NamedTuple):
    """How the values of a figure are spread.

    Attributes:
        least: The least value.
        mean: Their mean.
        most: The largest value.
        edges: (bars + 1), the ends of the bars of a histogram.
        counts: (bars), the number of items in each; an item at an end is in the bar above it.
    """

    least: float
    mean: float
    most: float
    edges: list[float]
    counts: list[int]


class Answered(NamedTuple):
    """An item that has been answered, in figures. See `api.store.tables.items`."""

    position: int
    outcome: str
    duration: float | None
    ratio: float | None
    seconds: float | None


class ReportFigures(NamedTuple):
    """The figures of the items of a batch for a report.

    Attributes:
        duration: How the durations of the trajectories are spread, s; None: there is none.
        ratio: How the largest shares of limits are spread, without unit.
        seconds: How the times that items took a worker are spread, s, in bars of equal factors.
        worst: The worst items, those first: the `longest`, `nearest` to a limit and `slowest` to compute.
        examples: The first items with each code of a problem.
    """

    duration: Spread | None
    ratio: Spread | None
    seconds: Spread | None
    worst: dict[str, list[Answered]]
    examples: dict[str, list[Answered]]

    def positions(self) -> list[int]:
        """List the items that are named, each once, the worst of every kind before the next of any."""
        kinds: list[list[Answered]] = [*self.worst.values(), *self.examples.values()]
        rows = range(max((len(found) for found in kinds), default=0))
        return list(dict.fromkeys(found[row].position for row in rows for found in kinds if row < len(found)))


def report_figures(connection: Connection, number: int, codes: Iterable[str]) -> ReportFigures:
    """Read the figures of a batch whose items have problems with these codes."""
    columns = items.c
    return ReportFigures(
        duration=_spread(connection, number, columns.duration),
        ratio=_spread(connection, number, columns.ratio, upper=1.0),
        seconds=_spread(connection, number, columns.seconds, by_factors=True),
        worst={
            "longest": _worst(connection, number, columns.duration),
            "nearest": _worst(connection, number, columns.ratio),
            "slowest": _worst(connection, number, columns.seconds, has_plan=False),
        },
        examples={code: _examples(connection, number, code) for code in codes},
    )


def shown_results(connection: Connection, number: int, positions: Sequence[int]) -> list[Result]:
    """Read the results that are small enough to be shown, in the order of the positions."""
    columns = (items.c[name] for name in Result._fields)
    size = func.length(items.c.request) + func.length(items.c.result)
    query = select(*columns).where(items.c.batch == number, items.c.position.in_(positions), size <= LARGEST)
    found = {row.position: Result(*row) for row in connection.execute(query)}
    return [found[position] for position in positions if position in found]


def _of(number: int) -> ColumnElement[bool]:
    """Choose the items of a batch that have been answered."""
    return (items.c.batch == number) & items.c.outcome.is_not(None)


def _spread(
    connection: Connection, number: int, figure: Any, upper: float | None = None, by_factors: bool = False
) -> Spread | None:
    """Count a figure in equal parts from its least value, or from 0 to `upper`."""
    extremes = select(func.min(figure), func.avg(figure), func.max(figure)).where(_of(number))
    least, mean, most = connection.execute(extremes).one()
    if least is None:
        return None
    steps = [bar / BARS for bar in range(BARS + 1)]
    if by_factors:
        first = max(least, LEAST_SECONDS)
        edges = [first * (max(most, LEAST_SECONDS) / first) ** step for step in steps]
    else:
        lower, last = (least, most) if upper is None else (0.0, upper)
        edges = [lower + (last - lower) * step for step in steps]
    inner = [(figure < edge, bar) for bar, edge in enumerate(edges[1:-1])]
    bar = case(*inner, else_=BARS - 1)
    counts = [0] * BARS
    for found, count in connection.execute(
        select(bar, func.count()).where(_of(number), figure.is_not(None)).group_by(bar)
    ):
        counts[found] = count
    return Spread(least, mean, most, edges, counts)


def _worst(connection: Connection, number: int, figure: Any, has_plan: bool = True) -> list[Answered]:
    """Find the items with the largest values of a figure, the largest first."""
    chosen = _of(number) & figure.is_not(None)
    if has_plan:
        chosen &= items.c.outcome == PLANNED
    return _answered(connection, chosen, WORST, figure.desc())


def _examples(connection: Connection, number: int, code: str) -> list[Answered]:
    """Find the first items with a code of a problem; the index finds them, as they have no duration."""
    chosen = (items.c.batch == number) & (items.c.outcome == code)
    return _answered(connection, chosen, EXAMPLES, items.c.duration)


def _answered(connection: Connection, chosen: ColumnElement[bool], limit: int, *order: Any) -> list[Answered]:
    columns = (items.c[name] for name in Answered._fields)
    query = select(*columns).where(chosen).order_by(*order, items.c.position).limit(limit)
    return [Answered(*row) for row in connection.execute(query)]
