"""The kind of router that the service has: HEAD wherever GET is, and ids of operations that are names of functions."""

from collections.abc import Callable
from typing import Any

from fastapi import APIRouter, Response
from fastapi.routing import APIRoute
from starlette.routing import Match
from starlette.types import Scope


class Route(APIRoute):
    """A route that sees at a glance that the path of a request is another one."""

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """See `fastapi.routing.APIRoute`."""
        if not self.param_convertors and not scope["path"].endswith(self.path):
            return Match.NONE, {}
        return super().matches(scope)


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

    def add_api_route(self, path: str, endpoint: Callable[..., Any], **options: Any) -> None:
        """Add a route; one for GET takes HEAD, too."""
        super().add_api_route(path, endpoint, **options)
        if options["methods"] == ["GET"]:
            head = options | {"methods": ["HEAD"], "include_in_schema": False}
            super().add_api_route(path, endpoint, **head)
