"""The byte budget: the bytes of bodies and answers that the server holds, bounded for all clients and for each."""

from __future__ import annotations

from collections import Counter

from api.base.errors import Overloaded


class Traffic:
    """The bytes of the bodies and answers of all requests under way, up to a bound.

    No client may hold more than it leaves free (the dynamic threshold of Choudhury and Hahne for shared buffers):
    one alone gets half of the room, each of three a quarter, and there is always room for one that comes.

    Attributes:
        held: The bytes of all clients.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._of_client: Counter[str] = Counter()
        self.held = 0

    def share(self, client: str) -> Share:
        """Open the account of one request of a client."""
        return Share(self, client)

    def hold(self, client: str, size: int) -> None:
        """Count more bytes of a client, or (negative) fewer.

        Raises:
            Overloaded: There is no room for them.
        """
        free = self._most - self.held - size
        if size > 0 and self._of_client[client] + size > free:
            raise Overloaded(
                "The service holds as many bytes of requests and answers as it can hold of one client now. Read the "
                "answers under way, or retry after 1 s.",
                headers={"Retry-After": "1"},
            )
        self.held += size
        self._of_client[client] += size
        if not self._of_client[client]:
            del self._of_client[client]


class Share:
    """The bytes of one request and its answer.

    Attributes:
        client: The client that they count for; it may change only while nothing is held.
    """

    def __init__(self, traffic: Traffic, client: str) -> None:
        self._traffic = traffic
        self._held = 0
        self.client = client

    def hold(self, size: int) -> None:
        """Count more bytes, until `release`; see `Traffic.hold`."""
        self._traffic.hold(self.client, size)
        self._held += size

    def release(self) -> None:
        """Count them no longer."""
        self._traffic.hold(self.client, -self._held)
        self._held = 0
