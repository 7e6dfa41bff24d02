"""Calls of tools: requests to the service, and its answers in the form that agents read."""

from __future__ import annotations

import base64
import json
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import httpx
from mcp_types import CallToolResult, ImageContent, TextContent

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cli.agents.tools import OperationTool

LONGEST_LIST = 24
"""The number of entries above which a list in an answer is shortened: an agent reads peaks, not samples."""

KEPT_ENTRIES = 3
"""The number of entries kept at both ends of a shortened list."""

SMALLEST_SHORTENED = 20_000
"""Characters of an answer below which nothing is shortened."""

BITMAPS = ("image/png", "image/jpeg")
"""The media types of pictures that agents get as pictures; SVG is text."""


async def call(
    client: httpx.AsyncClient, tool: OperationTool, arguments: Mapping[str, Any], authorization: str | None
) -> CallToolResult:
    """Send the request of a tool call to the service, and return its answer.

    A refusal is an error with the problem document: its `remedies` are changes that the service has tried.

    Args:
        client: A client whose base URL is the service.
        tool: The tool.
        arguments: The arguments, by the tool's schema.
        authorization: The header that names the key; None: none.
    """
    known = {"body", "accept", *tool.places}
    if unknown := sorted(set(arguments) - known):
        return _error(f"{', '.join(unknown)}: unknown; {tool.name} takes {', '.join(sorted(known))}")
    path, query = tool.path, {}
    for name, place in tool.places.items():
        if name not in arguments:
            continue
        if place == "path":
            path = path.replace(f"{{{name}}}", quote(str(arguments[name]), safe=""))
        else:
            query[name] = arguments[name]
    if "{" in path:
        return _error(f"{path[path.index('{') + 1 : path.index('}')]}: missing")
    headers = {"Accept": arguments.get("accept", tool.media_types[0])}
    if authorization is not None:
        headers["Authorization"] = authorization
    body = {"json": arguments["body"]} if "body" in arguments else {}
    try:
        response = await client.request(tool.method, path, params=query, headers=headers, **body)
    except httpx.HTTPError as error:
        return _error(f"the service at {client.base_url} does not answer: {type(error).__name__} {error}")
    return _result(response)


def _error(message: str) -> CallToolResult:
    return CallToolResult(content=[TextContent(text=message)], is_error=True)


def _result(response: httpx.Response) -> CallToolResult:
    """Return an answer of the service as the result of a tool call."""
    media_type = response.headers.get("content-type", "").partition(";")[0]
    is_error = response.is_error
    if media_type in BITMAPS:
        data = base64.b64encode(response.content).decode()
        return CallToolResult(content=[ImageContent(data=data, mime_type=media_type)], is_error=is_error)
    if media_type.endswith("json") and isinstance(answer := response.json(), dict):
        short = answer if len(response.content) < SMALLEST_SHORTENED else shortened(answer)
        text = json.dumps(short, ensure_ascii=False)
        return CallToolResult(content=[TextContent(text=text)], structured_content=short, is_error=is_error)
    try:
        text = response.content.decode()
    except UnicodeDecodeError:
        return _error(f"the answer is {len(response.content)} bytes of {media_type}: ask the service for it over HTTP")
    return CallToolResult(content=[TextContent(text=text)], is_error=is_error)


def shortened(part: Any) -> Any:
    """Return a part of an answer with the ends of long lists, and the number of entries left out."""
    if isinstance(part, dict):
        return {key: shortened(value) for key, value in part.items()}
    if not isinstance(part, list):
        return part
    if len(part) <= LONGEST_LIST:
        return [shortened(value) for value in part]
    first, last = part[:KEPT_ENTRIES], part[-KEPT_ENTRIES:]
    left_out = f"... {len(part) - 2 * KEPT_ENTRIES} more entries ..."
    return [*map(shortened, first), left_out, *map(shortened, last)]
