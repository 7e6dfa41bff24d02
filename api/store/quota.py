"""The daily quota of a key at all services that share a database."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from api.base.errors import TooManyRequests
from api.store.keys import count_requests

if TYPE_CHECKING:
    from api.store.database import Database

DAY = 86400.0
"""The time for which a quota is granted, s: from midnight to midnight, UTC."""

COUNTED_FOR = 1.0
"""The time for which requests are counted here alone, s: so much passes before other services hear of them."""


class Quota:
    """The daily quota of a key. Its used part is in the database, which is written once a second.

    Args:
        database: Where it is kept.
        key: The id of the key.
        requests: The most requests in a day.
    """

    def __init__(self, database: Database, key: str, requests: int) -> None:
        self.requests = requests
        self._database = database
        self._key = key
        self._day = -1
        self._counted = 0
        self._kept = 0
        self._seen = -COUNTED_FOR

    async def take(self, count: int) -> None:
        """Count requests.

        Raises:
            TooManyRequests: They are too many; none of them is counted.
            DatabaseUnavailable: They cannot be counted.
        """
        day = int(time.time() // DAY)
        if day != self._day or time.monotonic() - self._seen > COUNTED_FOR:
            await self.write()
        if self._kept + self._counted + count > self.requests:
            message = (
                f"The API key may send {self.requests} requests a day, batch items included. Retry after midnight UTC."
            )
            raise TooManyRequests(message, headers=self.headers() | {"Retry-After": str(_left_of_the_day())})
        self._counted += count

    async def write(self) -> None:
        """Write the requests counted since the last call, and read the counts of other services."""
        counted, self._counted = self._counted, 0
        self._day, self._seen = int(time.time() // DAY), time.monotonic()
        try:
            self._kept = await self._database.write(count_requests, self._key, self._day, counted)
        except BaseException:
            self._counted += counted
            self._seen = -COUNTED_FOR
            raise

    def headers(self) -> dict[str, str]:
        """Say how many requests are left, and after how many seconds all are back."""
        left = max(0, self.requests - self._kept - self._counted)
        return {
            "RateLimit-Limit": str(self.requests),
            "RateLimit-Remaining": str(left),
            "RateLimit-Reset": str(_left_of_the_day()),
        }


def _left_of_the_day() -> int:
    """Return the time until midnight, UTC, s."""
    return math.ceil(DAY - time.time() % DAY)
