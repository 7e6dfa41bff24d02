"""The MCP server: the tools of one planner service, over stdio or HTTP."""

from __future__ import annotations

from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

import httpx
import uvicorn
from mcp.server.lowlevel.server import Server
from mcp.server.stdio import stdio_server
from mcp_types import CallToolResult, ListToolsResult, TextContent, Tool, ToolAnnotations

from api.base.version import service_version
from cli.agents.calls import call
from cli.agents.tools import tools_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from mcp.server.context import ServerRequestContext
    from mcp_types import CallToolRequestParams, PaginatedRequestParams

    from cli.agents.tools import OperationTool

INSTRUCTIONS = """Plans trajectories of robot arms. Every plan is certified: it exceeds no limit at any time. SI units.
Start with list_robots and get_robot (joint names, limits, named positions). plan_trajectory takes waypoints. A refusal
is an error with a problem document. Each of its `remedies` is a change (JSON pointer `change`, new `value`) that the
service has tried: apply one and plan again. Long lists in answers are shortened. Nothing here moves a robot."""
"""The server's instructions for agents."""

TIMEOUT = 600.0
"""The time that the service may take for an answer, s: its own deadlines are shorter."""


def planner_server(
    url: str, key: str | None, transport: httpx.AsyncBaseTransport | None = None
) -> Server[httpx.AsyncClient]:
    """Make an MCP server whose tools are the computing operations of a service.

    A client over HTTP uses its own key: the server passes its `Authorization` header on.

    Args:
        url: The base URL of the service.
        key: The API key of callers without one of their own; None: none.
        transport: What carries requests to the service; None: the network.
    """
    tools: dict[str, OperationTool] = {}

    @asynccontextmanager
    async def connected(_: Server[httpx.AsyncClient]) -> AsyncIterator[httpx.AsyncClient]:
        async with httpx.AsyncClient(base_url=url, timeout=TIMEOUT, transport=transport) as client:
            yield client

    async def known_tools(client: httpx.AsyncClient) -> dict[str, OperationTool]:
        if not tools:
            response = await client.get("/openapi.json")
            response.raise_for_status()
            tools.update(tools_of(response.json()))
        return tools

    async def list_tools(
        context: ServerRequestContext[httpx.AsyncClient, Any], _: PaginatedRequestParams | None
    ) -> ListToolsResult:
        listed = (await known_tools(context.lifespan_context)).values()
        return ListToolsResult(tools=list(map(_described, listed)))

    async def call_tool(
        context: ServerRequestContext[httpx.AsyncClient, Any], params: CallToolRequestParams
    ) -> CallToolResult:
        client = context.lifespan_context
        tool = (await known_tools(client)).get(params.name)
        if tool is None:
            return CallToolResult(content=[TextContent(text=f"there is no tool {params.name}")], is_error=True)
        own = None if context.request is None else context.request.headers.get("authorization")
        authorization = own or (None if key is None else f"Bearer {key}")
        return await call(client, tool, params.arguments or {}, authorization)

    return Server(
        "trajectory-planner",
        version=service_version(),
        instructions=INSTRUCTIONS,
        lifespan=connected,
        on_list_tools=list_tools,
        on_call_tool=call_tool,
    )


def serve_http(server: Server[httpx.AsyncClient], host: str, port: int) -> None:
    """Serve clients over streamable HTTP, at the path /mcp, until SIGINT or SIGTERM."""
    app = server.streamable_http_app(host=host, stateless_http=True, json_response=True)
    uvicorn.run(app, host=host, port=port, log_level="warning")


async def serve_stdio(server: Server[httpx.AsyncClient]) -> None:
    """Serve one client over standard input and output until it ends."""
    async with stdio_server() as (read, write):
        await server.run(read, write, server.create_initialization_options())


def _described(tool: OperationTool) -> Tool:
    return Tool(
        name=tool.name,
        title=tool.title,
        description=tool.description,
        input_schema=dict(tool.input_schema),
        annotations=ToolAnnotations(read_only_hint=True, idempotent_hint=True, open_world_hint=False),
    )
