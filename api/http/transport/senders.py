"""The sender of a request: the client behind an address, and the id that it gave the request."""

from __future__ import annotations

import re
import uuid
from functools import lru_cache
from ipaddress import IPv6Address, IPv6Network, ip_address
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

SANE_ID = re.compile(rb"[A-Za-z0-9._-]{1,128}")
"""The request ids that are taken from callers: what can be put into any log."""


@lru_cache(maxsize=4096)
def client_of(address: str) -> str:
    """Name the client of an address, without the 64 lower bits of IPv6: clients choose them."""
    try:
        parsed = ip_address(address)
    except ValueError:
        return address
    if not isinstance(parsed, IPv6Address):
        return address
    return str(parsed.ipv4_mapped or IPv6Network((int(parsed), 64), strict=False))


def request_id(headers: Iterable[tuple[bytes, bytes]]) -> str:
    """Choose the id that the caller gave the request, where it is a sane one, else a new one."""
    for name, value in headers:
        if name == b"x-request-id" and SANE_ID.fullmatch(value):
            return str(value, "ascii")
    return uuid.uuid4().hex


def has_key(client: str) -> bool:
    """Tell whether the name of a client is that of an API key."""
    return client.startswith("key:")
