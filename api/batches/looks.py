"""The states of batches, shared by all followers: one read of the database a change, and one a moment."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from typing import TYPE_CHECKING, Any, NamedTuple

from sqlalchemy.exc import NoResultFound

from api.base.errors import UnknownBatch
from api.batches.status import described, range_of_durations
from api.store import batches
from api.store.items import PLANNED

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from api.store.batches import BatchRecord, Outcomes
    from api.store.database import Database

LOOK = 0.5
"""The time between two looks at a batch for its followers, s: as often as the engine writes outcomes."""

KNOWN_DESCRIPTIONS = 256
"""The number of batches whose descriptions are kept at hand: the latest."""

FORGOTTEN = "No stored batch has this id. GET /v1/batches lists them."
"""The refusal of an unknown or deleted batch."""


class Look(NamedTuple):
    """The state of a batch at one moment.

    Attributes:
        batch: The batch.
        description: Its description for clients.
    """

    batch: BatchRecord
    description: dict[str, Any]


class Looks:
    """One look at the database for all who follow a batch, and one description for all who ask about it.

    Args:
        database: Where the batches are.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._looks: dict[str, asyncio.Task[Look]] = {}
        self._descriptions: OrderedDict[int, tuple[BatchRecord, asyncio.Task[dict[str, Any]]]] = OrderedDict()

    async def find(self, batch_id: str, owner: str | None = None) -> BatchRecord:
        """Find a batch, of one client or (None) of any.

        Raises:
            UnknownBatch: There is none with this id.
        """
        found = await self._database.read(batches.find_batch, batch_id, owner)
        if found is None:
            raise UnknownBatch(FORGOTTEN)
        return found

    async def follow(self, batch_id: str) -> Look:
        """Look at a batch, or give what somebody else has seen of it within the last `LOOK` seconds.

        Raises:
            UnknownBatch: There is none with this id.
        """
        if batch_id not in self._looks:
            look = self._looks[batch_id] = asyncio.create_task(self._look(batch_id))
            look.add_done_callback(lambda _: self._forget_later(batch_id))
        return await asyncio.shield(self._looks[batch_id])  # who hangs up takes nothing from the others

    async def describe(self, batch: BatchRecord) -> dict[str, Any]:
        """Describe a batch, with the sums of the last description where nothing has changed.

        Raises:
            UnknownBatch: It has been forgotten since it was found.
        """
        known = self._descriptions.get(batch.number)
        if known is None or known[0] != batch or _has_failed(known[1]):
            known = self._descriptions[batch.number] = batch, asyncio.create_task(self._sum_up(batch))
        self._descriptions.move_to_end(batch.number)
        if len(self._descriptions) > KNOWN_DESCRIPTIONS:
            self._descriptions.popitem(last=False)
        return await asyncio.shield(known[1])

    async def _look(self, batch_id: str) -> Look:
        batch = await self.find(batch_id)
        return Look(batch, await self.describe(batch))

    def _forget_later(self, batch_id: str) -> None:
        if _has_failed(self._looks[batch_id]):
            del self._looks[batch_id]
        else:
            asyncio.get_running_loop().call_later(LOOK, self._looks.pop, batch_id)

    async def _sum_up(self, batch: BatchRecord) -> dict[str, Any]:
        try:
            return described(batch, *await self._database.read(_outcomes, batch.number))
        except NoResultFound as error:
            raise UnknownBatch(FORGOTTEN) from error


def _outcomes(connection: Connection, number: int) -> tuple[list[Outcomes], list[int], dict[str, int]]:
    """Read the outcomes of the items: their counts, the range of durations, and one for each code of a problem."""
    outcomes = batches.outcomes_of(connection, number)
    ends = range_of_durations(outcomes)
    histogram = [] if ends is None else batches.histogram_of(connection, number, PLANNED, *ends)
    codes = [found.outcome for found in outcomes if found.outcome not in {None, PLANNED}]
    return outcomes, histogram, {code: batches.one_with(connection, number, code) for code in codes if code is not None}


def _has_failed(task: asyncio.Task[Any]) -> bool:
    return task.done() and (task.cancelled() or task.exception() is not None)
