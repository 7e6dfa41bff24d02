"""The allowance of a key: requests a minute, and requests at once."""

from __future__ import annotations

import math

from api.base.errors import TooManyRequests

WINDOW = 60.0
"""The time for which the number of requests is granted, s."""


class Allowance:
    """The allowance of a key. As many requests as a minute has may come at once; then they come back evenly.

    Args:
        requests: The most requests in a minute.
        concurrent: The most requests under way.
        now: The time, s on a monotonic clock.
    """

    def __init__(self, requests: int, concurrent: int, now: float) -> None:
        self.requests = requests
        self.concurrent = concurrent
        self._left = float(requests)
        self._seen = now
        self._under_way = 0

    def enter(self, now: float) -> None:
        """Count a request, and that it is under way until `leave`.

        Raises:
            TooManyRequests: It is one too many; the headers say when to come again.
        """
        self._left = min(float(self.requests), self._left + (now - self._seen) * self.requests / WINDOW)
        self._seen = now
        if self._left < 1.0:
            wait = math.ceil((1.0 - self._left) * WINDOW / self.requests)
            message = f"The API key may send {self.requests} requests a minute. Retry after {wait} s."
            raise TooManyRequests(message, headers=self.headers() | {"Retry-After": str(wait)})
        if self._under_way >= self.concurrent:
            message = f"The API key may have {self.concurrent} requests under way. Retry after 1 s."
            raise TooManyRequests(message, headers=self.headers() | {"Retry-After": "1"})
        self._left -= 1.0
        self._under_way += 1

    def leave(self) -> None:
        """Count a request under way no longer."""
        self._under_way -= 1

    def headers(self) -> dict[str, str]:
        """Say how many requests are left, and after how many seconds all are back."""
        return {
            "RateLimit-Limit": str(self.requests),
            "RateLimit-Remaining": str(int(self._left)),
            "RateLimit-Reset": str(math.ceil((self.requests - self._left) * WINDOW / self.requests)),
        }
