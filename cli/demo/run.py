"""Runs the demo: starts the service, plans every case, shows a table, saves pictures, stops the service."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import httpx
from rich.text import Text

from cli.demo.cases import CASES, Case
from cli.local_service import ServiceDidNotStart, local_service
from cli.work.terminal import plain_table, problem_panel, share_text, terminal

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

COLUMNS = ("case", "back end", "duration", "velocity", "accel.", "error", "certificate", "computed")
"""The columns of the table."""

NUMBERS = ("duration", "velocity", "accel.", "error", "computed")
"""The columns that hold numbers."""

LEGEND = """
velocity, accel.  largest share of a joint's limit
error             at the waypoints: of the tool (m) for poses,
                  else of the joints (rad, or m)
certificate       exact check of every enforced limit; Cn: continuous up to
                  the nth derivative
computed          the plan alone, inverse kinematics and certificate included
"""

PAGE = "to look at robots and motions yourself: planner serve, then open http://127.0.0.1:8000/"
"""The last line, which leads to the page."""

DEADLINE = 60.0
"""The deadline of each request, s: the longest that a service allows. A picture takes 1 s on an idle machine."""


def run_demo(folder: Path, console: Console | None = None) -> int:
    """Plan every case and save its picture in `folder`.

    Returns:
        Exit status: 0, or 1 when something could not be planned.
    """
    console = console or terminal()
    folder.mkdir(parents=True, exist_ok=True)
    started = time.monotonic()
    try:
        with (
            console.status("starting the service"),
            local_service(folder / "service.log", workers=1) as (url, _),
            httpx.Client(base_url=url, timeout=2.0 * DEADLINE) as client,
        ):
            console.print(f"\nservice ready at {url} after {time.monotonic() - started:.1f} s\n")
            status = _plan_all(client, folder, console)
    except ServiceDidNotStart as error:
        console.print(Text(str(error), style="red"))
        return 1
    console.print(PAGE)
    return status


def _plan_all(client: httpx.Client, folder: Path, console: Console) -> int:
    table, refused = plain_table(*COLUMNS, right=NUMBERS), 0
    with console.status("planning and drawing") as status:
        for case in CASES:
            status.update(f"planning and drawing: {case.title}")
            request = case.request() | {"deadline": DEADLINE}
            response = client.post("/v1/trajectories", json=request)
            if response.is_error:
                console.print(Text(case.title, style="bold"), problem_panel(response.json()))
                refused += 1
                continue
            answer = response.json()
            table.add_row(*_row(case, request, answer, response.headers["Server-Timing"]))
            drawn = client.post("/v1/trajectories?format=png", json=request | {"picture": {"title": case.title}})
            (folder / f"{case.name}.png").write_bytes(drawn.raise_for_status().content)
    console.print(table)
    console.print(Text(LEGEND, style="dim"))
    console.print(f"the pictures and the service's log are in {folder}/")
    return 1 if refused else 0


def _row(case: Case, request: dict[str, Any], answer: dict[str, Any], server_timing: str) -> list[str | Text]:
    certificate = answer["certificate"]
    ratios = {check["quantity"]: check["ratio"] for check in certificate["checks"]}
    return [
        case.title,
        answer["backend"],
        f"{answer['duration']:.2f} s",
        share_text(ratios["velocity"]),
        share_text(ratios["acceleration"]),
        _error(request, answer),
        Text.assemble(
            ("kept", "green") if certificate["satisfied"] else ("violated", "red"), f", {certificate['continuity']}"
        ),
        f"{_milliseconds(server_timing, 'plan'):.1f} ms",
    ]


def _error(request: dict[str, Any], answer: dict[str, Any]) -> str:
    """Return the largest error at a waypoint: of the tool where the request has poses, else of a joint."""
    error = answer["certificate"]["waypoint_error"]
    if any(waypoint["kind"] != "joint" for waypoint in request["waypoints"]):
        error = max(waypoint["position_error"] for waypoint in answer["waypoints"])
    return f"{error:.0e}" if error else "0"


def _milliseconds(server_timing: str, name: str) -> float:
    """Read the duration of one entry of a `Server-Timing` header."""
    entries = dict(entry.split(";dur=") for entry in server_timing.split(", "))
    return float(entries[name])
