"""Requests to the planner service."""

from __future__ import annotations

import json
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

ERROR_CODES = {
    "unreachable_waypoint": -31,  # NO_IK_SOLUTION
    "start_in_collision": -10,  # START_STATE_IN_COLLISION
    "collision": -12,  # GOAL_IN_COLLISION
    "deadline_exceeded": -6,  # TIMED_OUT
    "invalid_request": -16,  # INVALID_GOAL_CONSTRAINTS
    "joint_position_limit": -16,
    "unknown_robot": -15,  # INVALID_GROUP_NAME
}
"""The error codes of `moveit_msgs/msg/MoveItErrorCodes` for problems of the service; PLANNING_FAILED for others."""

SUCCESS, PLANNING_FAILED, COMMUNICATION_FAILURE = 1, -1, -25
INVALID_GOAL_CONSTRAINTS, INVALID_ROBOT_STATE, INVALID_LINK_NAME = -16, -17, -18
FRAME_TRANSFORM_FAILURE, ROBOT_STATE_STALE = -21, -23

RESPONSE_SECONDS = 120.0
"""The time in which the service must answer, s."""


class RefusedError(Exception):
    """A request that gets no plan, with an error code of MoveIt."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


class PlannerService:
    """The planner service at an address.

    Args:
        url: The address, as in `http://127.0.0.1:8000`.
        key: The key of a service with keys; None: none.
    """

    def __init__(self, url: str, key: str | None = None) -> None:
        if not url.startswith(("http://", "https://")):
            raise ValueError(f"the address must start with http:// or https://; got {url}")
        self._url = url.rstrip("/")
        self._headers = {"Content-Type": "application/json"} | (
            {} if key is None else {"Authorization": f"Bearer {key}"}
        )

    def send(self, path: str, body: dict[str, Any] | None = None) -> Any:
        """Send a request, GET without a body and POST with one, and return the answer.

        Raises:
            RefusedError: The service answers with a problem, or not at all.
        """
        data = None if body is None else json.dumps(body).encode()
        request = Request(self._url + path, data, self._headers)  # noqa: S310 - the scheme is checked
        try:
            with urlopen(request, timeout=RESPONSE_SECONDS) as response:  # noqa: S310
                return json.load(response)
        except HTTPError as error:
            raise _refusal(error) from None
        except (URLError, TimeoutError, ConnectionError) as error:
            raise RefusedError(COMMUNICATION_FAILURE, f"{self._url} does not answer: {error}") from None


def _refusal(error: HTTPError) -> RefusedError:
    """Return the refusal in a problem document."""
    try:
        problem = json.load(error)
    except ValueError:
        return RefusedError(COMMUNICATION_FAILURE, f"the service answered {error.code}")
    remedies = "".join(f"; remedy: {remedy}" for remedy in problem.get("remedies", ())[:1])
    code = ERROR_CODES.get(problem.get("code", ""), PLANNING_FAILED)
    return RefusedError(code, f"{problem.get('code')}: {problem.get('detail')}{remedies}")
