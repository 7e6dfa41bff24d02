"""API keys: their text, their scopes, and their record in the database. Light to import."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from typing import Literal, NamedTuple, get_args

Scope = Literal["plan", "robots:write", "scenes:write", "projects:write", "batches", "admin"]
"""The scopes of a key: plan and compute, write robots, write scenes, write projects, use batches. `admin` has all of
them, also for the entries of others."""

SCOPES: tuple[Scope, ...] = get_args(Scope)
"""All scopes."""

PREFIX = "planner"
"""What every key begins with, so that searches for leaked secrets find it."""

ID_BYTES = 6
"""The random bytes of the public part of a key: enough that no two keys of a service have the same."""

SECRET_BYTES = 32
"""The random bytes of the secret part of a key: so many that nobody can try them all, and a plain hash will do."""

LONGEST_KEY = 128
"""The most characters that are looked at; a key has 64."""

NOBODY = "0" * 64
"""The digest that unknown keys are compared with, so that they take as long as known ones."""


class KeyRecord(NamedTuple):
    """The record of a key, without the key itself.

    Attributes:
        id: Its public part.
        name: What its holder calls it.
        digest: The SHA-256 of the whole key, as hexadecimal digits.
        scopes: Its scopes.
        requests_per_minute: The most requests in a minute; None: as the service's setting says.
        concurrent_requests: The most requests under way; None: as the service's setting says.
        created: When it was made, s since 1970.
        revoked: When it was revoked, s since 1970; None: it is valid.
        requests_per_day: The most requests in a day, batch items included; None: as the service's setting says.
    """

    id: str
    name: str
    digest: str
    scopes: frozenset[Scope]
    requests_per_minute: int | None
    concurrent_requests: int | None
    created: float
    revoked: float | None
    requests_per_day: int | None = None


def new_key() -> tuple[str, str]:
    """Make a key, and give its id and the key itself."""
    key_id = secrets.token_hex(ID_BYTES)
    return key_id, f"{PREFIX}_{key_id}_{secrets.token_urlsafe(SECRET_BYTES)}"


def id_of(key: str) -> str | None:
    """Find the public part of a key; None: this is no key."""
    prefix, _, rest = key.partition("_")
    key_id, _, secret = rest.partition("_")
    is_key = prefix == PREFIX and len(key_id) == 2 * ID_BYTES and secret != "" and len(key) <= LONGEST_KEY
    return key_id if is_key else None


def digest_of(key: str) -> str:
    """Compute the digest of a key."""
    return hashlib.sha256(key.encode()).hexdigest()


def is_valid(key: str, record: KeyRecord | None) -> bool:
    """Compare a key with its record, in a time that does not depend on the first difference."""
    is_right = hmac.compare_digest(digest_of(key), NOBODY if record is None else record.digest)
    return is_right and record is not None and record.revoked is None
