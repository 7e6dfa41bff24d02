"""The web sites whose pages may use the service: a browser sends the site's name in `Host`, the page's in `Origin`.

A browser lets any page send requests to any address. `Origin` reveals a page of another site. A page whose own
name was pointed at the service (DNS rebinding) looks like one of the service's own; `Host` reveals it.
"""

from __future__ import annotations

from functools import lru_cache
from ipaddress import ip_address
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from api.base.errors import ForeignOrigin, MisdirectedRequest
from api.base.settings import is_loopback

if TYPE_CHECKING:
    from starlette.types import Scope

    from api.base.settings import Settings

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
"""The methods that change and compute nothing; a browser keeps their answers from pages of other origins."""

PRIVATE_DOMAINS = frozenset(
    {"corp", "home", "internal", "intranet", "lan", "local", "localhost", "private", "svc", "test"}
)
"""The top-level domains of private networks (RFC 6761, RFC 6762 Appendix G): nobody can register a name in them."""


class Sites:
    """The names that the service is served under, and the origins whose pages may use it.

    Args:
        settings: The settings of the operator.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._names = frozenset(name.lower() for name in (settings.host, *settings.allowed_hosts))
        self._is_served_at = lru_cache(maxsize=1024)(lambda host: self.is_served_as(_name_in(host)))

    def check(self, scope: Scope) -> None:
        """Refuse a request that a page of another site has its browser send.

        Raises:
            MisdirectedRequest: The request was sent to a name that the service is not served under.
            ForeignOrigin: A page of another origin sent it, to change or to compute something.
        """
        headers: dict[bytes, bytes] = dict(scope["headers"])
        host = headers.get(b"host", b"").decode("latin-1")
        if not self._is_served_at(host):
            raise MisdirectedRequest("`Host` must be a name of the service. PLANNER_ALLOWED_HOSTS sets its names.")
        if scope["method"] in SAFE_METHODS or b"origin" not in headers:
            return
        if headers.get(b"sec-fetch-site") == b"same-origin":
            return
        origin, origins = headers[b"origin"].decode("latin-1"), self._settings.cors_origins
        if origin.partition("://")[2].lower() != host.lower() and origin not in origins and "*" not in origins:
            raise ForeignOrigin(
                "Web pages of this `Origin` may not use the service. PLANNER_CORS_ORIGINS sets the allowed ones."
            )

    def is_served_as(self, name: str) -> bool:
        """Tell whether requests to a name are meant for this service.

        Nobody can point an address, or the name of this machine, elsewhere. Without `allowed_hosts` a service with
        keys goes by any name, since a page of another site has no key. A service on a loopback address goes by no
        other name. Any other service goes by names of private networks, too.
        """
        if name in self._names or name == "localhost" or name.endswith(".localhost") or _is_address(name):
            return True
        if self._settings.allowed_hosts:
            return False
        if self._settings.asks_for_keys:
            return True
        return not is_loopback(self._settings.host) and ("." not in name or name.rpartition(".")[2] in PRIVATE_DOMAINS)


def _name_in(host: str) -> str:
    """Take the name, without the port, out of a `Host` header."""
    try:
        return (urlsplit(f"//{host}").hostname or "").rstrip(".")
    except ValueError:
        return host


def _is_address(name: str) -> bool:
    """Tell whether a name is an IP address; the empty one is that of HTTP/1.0, which browsers do not send."""
    try:
        return not name or bool(ip_address(name))
    except ValueError:
        return False
