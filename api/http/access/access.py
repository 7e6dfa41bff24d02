"""The client of a request and its rights: by its key where keys are required, else by its address."""

from __future__ import annotations

import time
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

import structlog

from api.base.api_keys import id_of, is_valid
from api.base.errors import DatabaseUnavailable, Forbidden, Unauthorized
from api.http.access.allowance import Allowance
from api.http.transport.senders import client_of
from api.store.clients import Client
from api.store.keys import find_key
from api.store.quota import Quota

if TYPE_CHECKING:
    from starlette.datastructures import Headers
    from starlette.requests import Request
    from starlette.types import Scope

    from api.base.api_keys import KeyRecord
    from api.base.api_keys import Scope as KeyScope
    from api.base.settings import Settings
    from api.store.database import Database

KNOWN_FOR = 1.0
"""The time for which a key is not looked up again, s: a revoked one is refused after as long."""

KNOWN_KEYS = 4096
"""The number of keys, real or not, that are remembered; the latest stay."""

CHALLENGE = {"WWW-Authenticate": 'Bearer realm="planner"'}
"""The header that says how to identify oneself (RFC 6750)."""

log = structlog.get_logger()


def client_by_address(scope: Scope) -> Client:
    """Find who sends a request where no key says it: whoever has its address."""
    return Client(client_of(scope["client"][0] if scope["client"] else ""))


class Access:
    """Lets requests in, or not.

    Attributes:
        asks_for_keys: Whether each request needs a key.
    """

    def __init__(self, settings: Settings, database: Database) -> None:
        self.asks_for_keys = settings.asks_for_keys
        self._settings = settings
        self._database = database
        self._known: OrderedDict[str, tuple[float, KeyRecord | None]] = OrderedDict()
        self._allowances: OrderedDict[str, Allowance] = OrderedDict()
        self._quotas: OrderedDict[str, Quota] = OrderedDict()

    async def key_of(self, headers: Headers, scope: KeyScope) -> KeyRecord:
        """Find the key of a request.

        Raises:
            Unauthorized: There is none, or it is unknown or revoked.
            Forbidden: It has another scope.
            DatabaseUnavailable: It cannot be looked up.
        """
        kind, _, key = headers.get("authorization", "").partition(" ")
        key_id = id_of(key.strip())
        if kind.lower() != "bearer" or key_id is None:
            raise Unauthorized("Send an API key in the header `Authorization: Bearer planner_...`.", headers=CHALLENGE)
        record = await self._record(key_id)
        if not is_valid(key.strip(), record) or record is None:
            raise Unauthorized("The API key is unknown or revoked. Send another one.", headers=CHALLENGE)
        if not {scope, "admin"} & record.scopes:
            challenge = f'{CHALLENGE["WWW-Authenticate"]}, error="insufficient_scope", scope="{scope}"'
            raise Forbidden(f"The API key must have the scope `{scope}`.", headers={"WWW-Authenticate": challenge})
        return record

    def allowance_of(self, key: KeyRecord) -> Allowance:
        """Find the allowance of a key."""
        requests = key.requests_per_minute or self._settings.key_requests_per_minute
        concurrent = key.concurrent_requests or self._settings.key_concurrent_requests
        if key.id not in self._allowances:
            self._allowances[key.id] = Allowance(requests, concurrent, time.monotonic())
        _remember(self._allowances, key.id)
        return self._allowances[key.id]

    def quota_of(self, key: KeyRecord) -> Quota | None:
        """Find the daily quota of a key; None: it has none."""
        requests = key.requests_per_day or self._settings.key_requests_per_day
        if not requests:
            return None
        if key.id not in self._quotas:
            self._quotas[key.id] = Quota(self._database, key.id, requests)
        _remember(self._quotas, key.id)
        return self._quotas[key.id]

    async def close(self) -> None:
        """Write the used quotas, for the other services and the next start."""
        try:
            for quota in self._quotas.values():
                await quota.write()
        except DatabaseUnavailable:
            log.warning("quotas_left", reason="the database does not answer")

    async def _record(self, key_id: str) -> KeyRecord | None:
        seen, record = self._known.get(key_id, (-KNOWN_FOR, None))
        if time.monotonic() - seen > KNOWN_FOR:
            record = await self._database.read(find_key, key_id)
            self._known[key_id] = time.monotonic(), record
            _remember(self._known, key_id)
        return record


def _remember(known: OrderedDict[str, Any], name: str) -> None:
    known.move_to_end(name)
    if len(known) > KNOWN_KEYS:
        known.popitem(last=False)


def audit(request: Request, action: str, subject: str) -> None:
    """Log who changed what."""
    state = request.state
    log.info("audit", action=action, subject=subject, client=state.client.name, request_id=state.request_id)
