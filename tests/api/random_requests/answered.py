"""Answers in the form for judges: the polynomials, and the conditions in force at each time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator


class Answered:
    """Polynomials of an answer.

    Attributes:
        breakpoints: (pieces + 1,), s.
        coefficients: (pieces, joints, powers), ascending powers of the time since the piece began.
    """

    def __init__(self, joints: list[dict[str, Any]]) -> None:
        self.breakpoints = np.array(joints[0]["breakpoints"])
        most = max(len(row) for joint in joints for row in joint["coefficients"])
        padded = [[row + [0.0] * (most - len(row)) for row in joint["coefficients"]] for joint in joints]
        self.coefficients = np.array(padded).transpose(1, 0, 2)

    def derivatives(self, pieces: np.ndarray, since: np.ndarray, orders: int = 4) -> list[np.ndarray]:
        """Return positions, velocities, accelerations and jerks, each (N, joints), at times (N,) on pieces (N,)."""
        values, own = [], self.coefficients[pieces]
        for _ in range(orders):
            values.append(np.einsum("njp,np->nj", own, since[:, None] ** np.arange(own.shape[2])))
            own = own[:, :, 1:] * np.arange(1, own.shape[2]) if own.shape[2] > 1 else 0.0 * own
        return values

    def at(self, times: np.ndarray, orders: int = 1) -> list[np.ndarray]:
        """Return positions and their derivatives, each (N, joints), at times (N,) since the start."""
        pieces = np.clip(np.searchsorted(self.breakpoints, times, "right") - 1, 0, len(self.coefficients) - 1)
        return self.derivatives(pieces, times - self.breakpoints[pieces], orders)


class Segment(NamedTuple):
    """An interval of an answer with the same conditions.

    Attributes:
        index: Of the waypoint that it ends at; None: it is all of a trajectory.
        first: When it begins, s.
        last: When it ends, s.
        limits: All that hold on it.
        tool: The tool, as the request has it; None: the robot's own.
        payload: The body that is carried; None: nothing is.
    """

    index: int | None
    first: float
    last: float
    limits: list[dict[str, Any]]
    tool: dict[str, Any] | None
    payload: dict[str, Any] | None


def segments(request: dict[str, Any], answer: dict[str, Any]) -> Iterator[Segment]:
    """Yield the segments of a plan's answer, or the whole trajectory of another answer."""
    whole, tool, payload = request.get("limits", {}), request.get("tool"), request.get("payload")
    waypoints = request.get("waypoints")
    if waypoints is None:
        yield Segment(None, -1.0, np.inf, [whole], tool, payload)
        return
    times = times_of(answer)
    for k, waypoint in enumerate(waypoints):
        tool = waypoint.get("tool") or tool
        if k:
            limits = [whole, waypoint.get("limits") or {}]
            yield Segment(k, times[k - 1]["departure_time"], times[k]["arrival_time"], limits, tool, payload)
        payload = None if waypoint.get("put_down") else waypoint.get("payload") or payload


def times_of(answer: dict[str, Any]) -> dict[int, dict[str, Any]]:
    """Return the waypoints of an answer by their indices in the request, without the corners of detours."""
    return {row["index"]: row for row in answer["waypoints"] if row["choice"] != "detour"}
