"""A Dask cluster that plans the requests of batches, as the service sees it."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import structlog

from api.base.logs import where_from
from api.base.version import service_version
from api.batches.planners import ChunkSize

if TYPE_CHECKING:
    from api.batches.planners import Chunk
    from api.pool.messages import Reply

CHUNK_SECONDS = 1.0
"""The time that a chunk should take, s: many times what sending it costs, and no more is lost with a machine."""

MOST_CHUNKED = 100
"""The most requests of a chunk, however quick they are."""

LOOKING = 1.0
"""The time between two looks at the cluster, or two tries to reach it, s."""

CONNECTING = 10.0
"""The time for which the scheduler may not answer before the connection is made anew, s."""

log = structlog.get_logger()


class ClusterPlanners:
    """The planning processes of the machines that have joined a cluster (`planner worker`).

    Nothing of a batch is kept there. The scheduler gives the chunks of a lost worker to another one. The chunks lost
    with the scheduler are sent again when it is back.

    Args:
        address: Where the scheduler listens, as in `tcp://10.0.0.1:8786`.

    Raises:
        ImportError: The extra `cluster` is not installed.
    """

    def __init__(self, address: str) -> None:
        import distributed

        self.at_once = 1
        self.chunk_size = 1
        self._distributed = distributed
        self._address = address
        self._client: Any = None
        self._connecting = asyncio.Lock()
        self._size = ChunkSize(CHUNK_SECONDS, MOST_CHUNKED)
        self._watching: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """See `api.batches.planners.Planners`."""
        self._watching = asyncio.create_task(self._watch())

    async def stop(self) -> None:
        """See `api.batches.planners.Planners`."""
        if self._watching is not None:
            self._watching.cancel()
            await asyncio.gather(self._watching, return_exceptions=True)
        await self._disconnect()

    async def plan(self, chunk: Chunk) -> list[Reply]:
        """See `api.batches.planners.Planners`; it waits for as long as there is no cluster."""
        from api.batches.cluster_worker import plan_chunk

        while True:
            try:
                client = await self._connected()
                future = client.submit(plan_chunk, service_version(), chunk, pure=False)
                try:
                    seconds, replies = await future
                finally:
                    future.release()
            except Exception as error:  # noqa: BLE001 - whatever happens to the cluster, the work goes on when it is back
                log.warning("cluster_lost_work", requests=len(chunk.items), failure=where_from(error))
                await asyncio.sleep(LOOKING)
            else:
                self.chunk_size = self._size.learn(seconds / len(chunk.items))
                return list(replies)

    async def _watch(self) -> None:
        """Keep the connection, and know how many planning processes there are."""
        while True:
            try:
                client = await self._connected()
                threads: dict[str, int] = await asyncio.wait_for(client.nthreads(), CONNECTING)
                self.at_once = max(1, 2 * sum(threads.values()))  # so many that the next ones wait at the machines
            except Exception as error:  # noqa: BLE001 - it is tried again
                log.warning("cluster_unreachable", scheduler=self._address, failure=where_from(error))
                await self._disconnect()
            await asyncio.sleep(LOOKING)

    async def _connected(self) -> Any:
        """Connect to the scheduler, unless it is done."""
        async with self._connecting:
            if self._client is None or self._client.status == "closed":
                options: dict[str, Any] = {"asynchronous": True, "set_as_default": False, "timeout": CONNECTING}
                self._client = await self._distributed.Client(self._address, **options)
            return self._client

    async def _disconnect(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            with suppress(Exception):  # it is gone, or does not answer
                await asyncio.wait_for(client.close(), CONNECTING)
