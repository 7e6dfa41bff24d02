"""Batches of the command line: planned by a service, followed and written into a folder."""

from __future__ import annotations

import os
import shutil
import time
from base64 import b64decode
from contextlib import contextmanager
from hashlib import sha256
from typing import TYPE_CHECKING, Any, NamedTuple

import httpx
import orjson
import typer
from matplotlib.figure import Figure
from rich import progress as bars

from api.base.processors import available_processors
from api.work.answers.formats import FORMATS
from cli.local_service import ServiceDidNotStart, local_service
from cli.work.shared import write
from cli.work.terminal import plain_table, problem_panel, terminal

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from rich.console import Console

WORK = ".planner"
"""The folder beside the results where a batch that is under way is kept; it goes when all is done."""

LOOK = 0.3
"""The time between two looks at a batch, s."""

BINS = 40
"""The number of bars of a histogram."""

INTERRUPTED = 130
"""The exit status after Ctrl-C, as shells have it."""


class Asked(NamedTuple):
    """A batch to plan.

    Attributes:
        body: The body for POST /v1/batches.
        media_type: Its media type.
        folder: Where the results go.
        form: The format of the plans; None: all in one file with a line each.
        url: The service; None: one that is started for it.
        workers: The planning processes of that one; None: one a core.
        report: Where the report goes; None: nowhere.
    """

    body: bytes
    media_type: str
    folder: Path
    form: str | None
    url: str | None
    workers: int | None
    report: Path | None


def run_batch(asked: Asked) -> None:
    """Plan a batch, write its results, and end with 1 where an item is refused."""
    console = terminal(stderr=True)
    try:
        asked.folder.mkdir(parents=True, exist_ok=True)
        with _service(asked, console) as client:
            location = _sent(client, asked)
            description = _followed(client, location, console)
            durations = _written(client, location, asked)
            if asked.report is not None:
                answer = client.get(f"{location}/report")
                _refuse_unless_success(answer)
                write(asked.report, answer.content, console)
        _summarise(description, durations, asked.folder, console)
    except KeyboardInterrupt:
        console.print("interrupted; the same command goes on where it was")
        raise typer.Exit(INTERRUPTED) from None
    except (ServiceDidNotStart, httpx.HTTPError, OSError) as error:
        console.print(str(error), style="red")
        raise typer.Exit(2) from None
    raise typer.Exit(1 if description["counts"]["refused"] else 0)


@contextmanager
def _service(asked: Asked, console: Console) -> Iterator[httpx.Client]:
    """Reach the service that is named, or start one that keeps the batch beside the results until it is done."""
    if asked.url is not None:
        key = os.environ.get("PLANNER_KEY")
        headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        with httpx.Client(base_url=asked.url, headers=headers, timeout=60.0) as client:
            yield client
        return
    workers = asked.workers or available_processors()
    work = asked.folder / WORK
    work.mkdir(exist_ok=True)
    settings = {"PLANNER_DATA_DIRECTORY": str(work.absolute()), "PLANNER_BATCH_WORKERS": str(workers)}
    console.print("starting the planning processes", style="dim")
    with (
        local_service(work / "service.log", workers, settings=settings) as (url, _),
        httpx.Client(base_url=url, timeout=60.0, trust_env=False) as client,
    ):
        yield client
    shutil.rmtree(work)


def _sent(client: httpx.Client, asked: Asked) -> str:
    """Send the batch; the same one again is the one that was sent before."""
    headers = {"Content-Type": asked.media_type, "Idempotency-Key": sha256(asked.body).hexdigest()}
    answer = client.post("/v1/batches", content=asked.body, headers=headers)
    _refuse_unless_success(answer)
    location: str = answer.headers["Location"]
    return location


def _refuse_unless_success(answer: httpx.Response) -> None:
    """Show the problem document that came in place of an answer, and end with 2."""
    if not answer.is_success:
        answer.read()
        terminal(stderr=True).print(problem_panel(answer.json()))
        raise typer.Exit(2)


def _followed(client: httpx.Client, location: str, console: Console) -> dict[str, Any]:
    """Show the progress of the batch until it has ended."""
    rate_column = bars.TextColumn("{task.fields[rate]}")
    columns = (bars.BarColumn(), bars.MofNCompleteColumn(), bars.TimeElapsedColumn(), bars.TimeRemainingColumn())
    with bars.Progress(*columns, rate_column, console=console) as progress:
        shown = progress.add_task("", total=None, rate="")
        while True:
            answer = client.get(location)
            _refuse_unless_success(answer)
            batch: dict[str, Any] = answer.json()
            counts = batch["counts"]
            rate = "" if batch["rate"] is None else f"{batch['rate']:.1f}/s"
            progress.update(shown, total=counts["total"], completed=counts["total"] - counts["waiting"], rate=rate)
            if batch["status"] != "running":
                return batch
            time.sleep(LOOK)


def _written(client: httpx.Client, location: str, asked: Asked) -> list[float]:
    """Write all results, in one file with a line each or in one file each, and give the durations, s."""
    durations = []
    query = {} if asked.form is None else {"format": asked.form}
    part = asked.folder / "results.ndjson.part"
    with client.stream("GET", f"{location}/results.ndjson", params=query) as answer, part.open("wb") as lines:
        _refuse_unless_success(answer)
        for line in answer.iter_lines():
            result = orjson.loads(line)
            if result.get("duration") is not None:
                durations.append(result["duration"])
            if result.get("content") is not None:
                _write_plan(asked.folder, result, str(asked.form))
                del result["content"]
            lines.write(orjson.dumps(result) + b"\n")
    part.rename(asked.folder / "results.ndjson")
    return durations


def _write_plan(folder: Path, result: dict[str, Any], form: str) -> None:
    content = result["content"]
    file = folder / f"{result['index']:06d}{FORMATS[form].suffix}"
    file.write_bytes(b64decode(content) if result["encoding"] == "base64" else content.encode())


def _summarise(batch: dict[str, Any], durations: list[float], folder: Path, console: Console) -> None:
    """Show the outcome of the batch, and draw a histogram of durations."""
    counts, summary = batch["counts"], batch["summary"]
    table = plain_table("outcome", "requests", right=["requests"])
    table.add_row("planned", str(counts["planned"]))
    for refusal in summary["refusals"]:
        table.add_row(refusal["code"], str(refusal["count"]))
    console.print(table)
    if summary["duration"] is not None:
        shortest, mean, longest = (summary["duration"][name] for name in ("shortest", "mean", "longest"))
        console.print(f"durations {shortest:.3f} to {longest:.3f} s, mean {mean:.3f} s")
    if summary["worst_ratio"] is not None:
        console.print(f"largest share of a limit {100.0 * summary['worst_ratio']:.1f} %")
    if durations:
        _draw(durations, folder / "durations.png")
    console.print(f"results in {folder}")


def _draw(durations: list[float], file: Path) -> None:
    figure = Figure(figsize=(6.0, 3.0), layout="constrained")
    axes = figure.add_subplot()
    axes.hist(durations, bins=min(BINS, len(durations)))
    axes.set_xlabel("duration of the trajectory (s)")
    axes.set_ylabel("plans")
    figure.savefig(file)
