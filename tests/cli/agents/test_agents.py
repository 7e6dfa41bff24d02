"""The service as tools of agents, seen by the client of the package mcp: in process, over stdio and over HTTP."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import anyio
import httpx
import jsonschema
import pytest
from mcp.client.client import Client
from mcp.client.stdio import StdioServerParameters
from mcp_types import CallToolResult, ImageContent, TextContent, Tool

from cli.agents.calls import KEPT_ENTRIES, LONGEST_LIST, shortened
from cli.agents.server import planner_server
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from mcp_types import ListToolsResult

    from tests.api.conftest import RunningService

TOO_SHORT = {
    "robot": "three_dof_arm",
    "waypoints": [
        {"kind": "joint", "position": [0.0, 0.5, 0.5]},
        {"kind": "joint", "position": [0.5, 1.0, 1.0], "duration": 1e-3},
    ],
}
"""A request whose duration is too short."""

START_TIMEOUT = 60.0
"""The time that a server may take to start, s."""


def text_of(result: CallToolResult) -> str:
    (content,) = result.content
    assert isinstance(content, TextContent)
    return content.text


def called(server: Any, name: str, arguments: dict[str, Any]) -> CallToolResult:
    async def run() -> CallToolResult:
        async with Client(server) as client:
            result = await client.call_tool(name, arguments)
            assert isinstance(result, CallToolResult)
            return result

    return anyio.run(run)


def listed(server: Any) -> ListToolsResult:
    async def run() -> ListToolsResult:
        async with Client(server) as client:
            return await client.list_tools()

    return anyio.run(run)


@pytest.fixture(scope="module")
def tools(service: RunningService) -> dict[str, Tool]:
    return {tool.name: tool for tool in listed(planner_server(service.url, None)).tools}


@pytest.mark.large_only
def test_tools_are_the_operations_that_compute_or_read(service: RunningService, tools: dict[str, Tool]) -> None:
    operations = {
        operation["operationId"]: (method, operation)
        for methods in service.client.get("/openapi.json").json()["paths"].values()
        for method, operation in methods.items()
    }
    assert {"plan_trajectory", "compare_backends", "validate_trajectory", "list_robots", "get_scene"} <= set(tools)
    assert not {"add_robot", "delete_robot", "add_scene", "change_scene", "create_batch", "get_metrics"} & set(tools)
    for name, tool in tools.items():
        method, operation = operations[name]
        assert tool.title == operation["summary"]
        assert method in {"get", "post"}
        jsonschema.Draft202012Validator.check_schema(tool.input_schema)

        assert "#/components" not in json.dumps(tool.input_schema)


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.json")), ids=lambda path: path.stem)
def test_the_schema_of_plan_trajectory_accepts_the_examples(path: Path, tools: dict[str, Tool]) -> None:
    arguments = {"body": json.loads(path.read_text(encoding="utf-8"))}
    jsonschema.Draft202012Validator(tools["plan_trajectory"].input_schema).validate(arguments)


def test_a_refusal_has_a_remedy_that_works_when_it_is_applied(service: RunningService) -> None:
    server = planner_server(service.url, None)
    refused = called(server, "plan_trajectory", {"body": TOO_SHORT})
    assert refused.is_error
    problem = json.loads(text_of(refused))
    assert problem == refused.structured_content
    assert problem["code"] == "infeasible_duration"
    remedy = problem["remedies"][0]
    assert remedy["change"] == "/waypoints/1/duration"
    better = json.loads(json.dumps(TOO_SHORT))
    better["waypoints"][1]["duration"] = remedy["value"]
    planned = called(server, "plan_trajectory", {"body": better})
    assert not planned.is_error
    assert json.loads(text_of(planned))["certificate"]["satisfied"]


def test_long_answers_have_the_ends_of_their_lists(service: RunningService) -> None:
    body = {**TOO_SHORT, "duration": 10.0, "waypoints": [w | {"duration": None} for w in TOO_SHORT["waypoints"]]}  # type: ignore[operator]
    whole = service.post("/v1/trajectories", body).json()
    short = json.loads(text_of(called(planner_server(service.url, None), "plan_trajectory", {"body": body})))
    times, kept = whole["samples"]["time"], short["samples"]["time"]
    assert len(times) > LONGEST_LIST
    assert kept[:KEPT_ENTRIES] + kept[-KEPT_ENTRIES:] == times[:KEPT_ENTRIES] + times[-KEPT_ENTRIES:]
    assert kept[KEPT_ENTRIES] == f"... {len(times) - 2 * KEPT_ENTRIES} more entries ..."
    assert short["certificate"] == whole["certificate"]


def test_short_lists_stay_whole() -> None:
    answer = {"a": list(range(LONGEST_LIST)), "b": [{"c": [1, 2]}], "d": None}
    assert shortened(answer) == answer


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("name", "arguments", "text"),
    [
        ("get_robot", {"id": "no such robot?"}, "unknown_robot"),
        ("get_robot", {}, "id: missing"),
        ("list_backends", {"nonsense": 1}, "nonsense: unknown; list_backends takes"),
        ("plan_trajectory", {"body": {}}, "invalid_request"),
        ("delete_robot", {"id": "kuka_kr16_2"}, "there is no tool delete_robot"),
        ("reboot", {}, "there is no tool reboot"),
    ],
)
def test_bad_calls_say_what_is_wrong(name: str, arguments: dict[str, Any], text: str, service: RunningService) -> None:
    result = called(planner_server(service.url, None), name, arguments)
    assert result.is_error
    assert text in text_of(result)


@pytest.mark.large_only
def test_pictures_come_as_pictures(service: RunningService) -> None:
    arguments = {"body": {"robot": "three_dof_arm"}, "accept": "image/png"}
    (content,) = called(planner_server(service.url, None), "workspace", arguments).content
    assert isinstance(content, ImageContent)
    assert content.mime_type == "image/png"


def test_a_service_that_does_not_answer_is_an_error_of_the_call(service: RunningService) -> None:
    def answer(request: httpx.Request) -> httpx.Response:
        if request.url.path == "/openapi.json":
            return httpx.Response(200, content=service.client.get("/openapi.json").content)
        raise httpx.ConnectError("gone")

    server = planner_server("http://planner.invalid", None, httpx.MockTransport(answer))
    result = called(server, "list_robots", {})
    assert result.is_error
    assert "does not answer" in text_of(result)


def test_the_key_of_the_caller_goes_before_that_of_the_server(service: RunningService) -> None:
    seen = []

    def answer(request: httpx.Request) -> httpx.Response:
        seen.append(request.headers.get("authorization"))
        return httpx.Response(200, content=service.client.get("/openapi.json").content)

    called(planner_server("http://planner.invalid", "secret", httpx.MockTransport(answer)), "get_limits", {})
    assert seen == [None, "Bearer secret"]


@pytest.mark.large_only
def test_the_command_serves_stdio(service: RunningService) -> None:
    command = StdioServerParameters(
        command=sys.executable, args=["-m", "cli", "mcp", "--url", service.url], cwd=str(ROOT)
    )
    robots = called(command, "list_robots", {})
    assert "three_dof_arm" in text_of(robots)


@pytest.mark.large_only
def test_the_command_serves_http_and_passes_keys_on(service: RunningService) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "cli", "mcp", "--url", service.url, "--port", str(port)]
    with subprocess.Popen(command, cwd=ROOT) as process:
        try:
            url = f"http://127.0.0.1:{port}/mcp"
            end = time.monotonic() + START_TIMEOUT
            while True:
                try:
                    socket.create_connection(("127.0.0.1", port)).close()
                    break
                except OSError:
                    assert time.monotonic() < end
                    time.sleep(0.05)
            assert "three_dof_arm" in text_of(called(url, "list_robots", {}))
            evil = httpx.post(url, json={}, headers={"Host": "evil.example"})
            assert evil.status_code in {403, 421}
        finally:
            process.terminate()
