"""The kind of router that the service has: HEAD wherever GET is, and ids of operations that are names of functions."""

from typing import Any

from fastapi import APIRouter, Response
from fastapi.routing import APIRoute
from starlette.routing import Match
from starlette.types import Receive, Scope, Send
from typing_extensions import override


class Route(APIRoute):
    """A route that takes HEAD where it takes GET, and sees at a glance that the path of a request is another one.

    Attributes:
        allowed: The methods that the route takes.
    """

    def __init__(self, path: str, *arguments: Any, **options: Any) -> None:
        super().__init__(path, *arguments, **options)
        self._beginning, parameter, _ = path.partition("{")
        self._is_fixed = not parameter
        methods = self.methods or set()
        self.allowed = methods | {"HEAD"} if "GET" in methods else methods

    @override
    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """See `starlette.routing.Route`."""
        path: str = scope["path"]
        if not (path == self._beginning if self._is_fixed else path.startswith(self._beginning)):
            return Match.NONE, {}
        return super().matches({**scope, "method": "GET"} if scope["method"] == "HEAD" else scope)

    @override
    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See `starlette.routing.Route`."""
        if scope["method"] in self.allowed:
            await self.app(scope, receive, send)
        else:
            await super().handle(scope, receive, send)


class Router(APIRouter):
    """A router whose routes answer with responses that are ready to be sent.

    Args:
        options: See `fastapi.APIRouter`.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(
            route_class=Route,
            default_response_class=Response,
            generate_unique_id_function=lambda route: route.name,
            **options,
        )
