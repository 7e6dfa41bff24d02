"""Cost keys: the parts of a body by which an operation declares its duration. No body need follow its schema."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from api.contract.cells import MOST_ROBOTS
from api.contract.parts.free_motions import motions_of
from api.pool.costs import Kind

CostKey = Callable[[Mapping[str, Any]], tuple[Any, ...]]
"""A function of a body as JSON. Its results are few, and no text of a client is among them."""

ROWS = ("waypoints", "tasks", "poses", "positions", "points")
"""The fields whose length tells the size of a request."""

SLOW_MOTIONS = ("linear", "circular", "polyline", "spline", "free")
"""The kinds of motion that have to be followed with the joints, or sought, which takes most of their request's time."""

BACKENDS = ("cubic", "quintic", "trapezoidal", "ruckig", "toppra", "min_effort", "auto")
"""The kinds of back ends, which only workers load."""

SLOW_OPTIONS = ("jerk_limited",)
"""The options of back ends that, switched on, take most of their request's time."""

LARGEST = 1e6
"""The number of seconds beyond which a budget says nothing: the request will be refused."""


def kind_of(operation: str, document: Mapping[str, Any], cost_key: CostKey, size: int = 0) -> Kind:
    """Find the kind of the task of a request.

    Args:
        operation: The id of the operation.
        document: The body as JSON.
        cost_key: The cost key of the operation.
        size: The bytes of the body and of all that it names.
    """
    rows = max([len(document[name]) for name in ROWS if isinstance(document.get(name), list)], default=0)
    return Kind((operation, *cost_key(document)), (rows + size // 1024).bit_length())


def by_size(_document: Mapping[str, Any]) -> tuple[Any, ...]:
    """Declare that only the size of a body decides the duration of the operation."""
    return ()


def by_plan(document: Mapping[str, Any]) -> tuple[Any, ...]:
    """Declare that the back end, slow motions, searches and the time budgets decide the duration of the operation."""
    motions = list(motions_of(document.get("waypoints")))
    is_slow = any(motion.get("kind") in SLOW_MOTIONS for motion in motions)
    budgets = [asked.get("time_budget") for asked in (document, *motions) if asked.get("optimise")]
    waypoints = document.get("waypoints")
    listed = waypoints if isinstance(waypoints, list) else ()
    rides = any(isinstance(waypoint, dict) and waypoint.get("on") is not None for waypoint in listed)
    seconds = sum(budget for budget in budgets if isinstance(budget, int | float) and 0.0 <= budget < LARGEST)
    return (_options(document.get("backend")), is_slow, bool(budgets) or rides, round(seconds).bit_length())


def by_cell(document: Mapping[str, Any]) -> tuple[Any, ...]:
    """Declare that the number of robots, slow motions and the time budgets decide the duration of the operation."""
    robots = document.get("robots")
    members = [robot for robot in robots if isinstance(robot, dict)] if isinstance(robots, list) else []
    keys = [by_plan(robot)[1:] for robot in members[:MOST_ROBOTS]]
    return (len(keys), *map(max, zip(*keys, strict=True)))


def by_roadmap(document: Mapping[str, Any]) -> tuple[Any, ...]:
    """Declare that the number of samples decides the duration of the operation."""
    samples = document.get("samples")
    return (samples.bit_length(),) if isinstance(samples, int) and 0 <= samples < LARGEST else ()


def by_plan_of(index: int) -> CostKey:
    """Declare the same for the plan by one of the `backends` of a comparison."""

    def key(document: Mapping[str, Any]) -> tuple[Any, ...]:
        backends = document.get("backends")
        backend = backends[index] if isinstance(backends, list) and index < len(backends) else None
        return by_plan({**document, "backend": backend})

    return key


def _options(backend: Any) -> tuple[Any, ...]:
    """Name the kind of a back end and its slow options that are switched on."""
    if not isinstance(backend, dict):
        return ()
    known = backend.get("kind") if backend.get("kind") in BACKENDS else "other"
    return (known, *(name for name in SLOW_OPTIONS if backend.get(name) is True))
