"""The command line of batches: `planner batch` and `planner sweep`."""

from __future__ import annotations

import os
import shutil
import time
from base64 import b64decode
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from api.base.processors import available_processors
from cli.shared import write

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx
    from rich.console import Console

WORK = ".planner"
"""The folder beside the results where a batch that is under way is kept; it goes when all is done."""

LOOK = 0.3
"""The time between two looks at a batch, s."""

BINS = 40
"""The number of bars of a histogram."""

INTERRUPTED = 130
"""The exit status after Ctrl-C, as shells have it."""

OutputOption = Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Folder of the results.")]
FormatOption = Annotated[
    str | None,
    typer.Option(
        "--format", metavar="NAME", help="Write each plan into a file in this form.", show_default="all as JSON lines"
    ),
]
UrlOption = Annotated[
    str | None,
    typer.Option(
        "--url",
        metavar="URL",
        help="Service that plans; its key is in the environment variable PLANNER_KEY.",
        show_default="one of its own",
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", help="Planning processes.", show_default="one a core", min=1, max=256),
]
ReportOption = Annotated[
    Path | None,
    typer.Option(
        "--report",
        metavar="FILE",
        help="Write a report that anyone can open, one HTML file: histograms, refusals, the worst plans.",
        show_default="none",
        dir_okay=False,
    ),
]


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


def batch(
    requests: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="Requests of POST /v1/trajectories, a line each.", dir_okay=False, exists=True
        ),
    ],
    output: OutputOption,
    format_: FormatOption = None,
    url: UrlOption = None,
    workers: WorkersOption = None,
    report: ReportOption = None,
) -> None:
    """Plan many requests. After Ctrl-C the same command goes on where it was.

    Ends with 0 where all are planned, with 1 where some are refused.
    """
    _run(Asked(requests.read_bytes(), "application/x-ndjson", output, format_, url, workers, report))


def sweep(
    template: Annotated[
        Path, typer.Argument(metavar="FILE", help="Request of POST /v1/trajectories.", dir_okay=False, exists=True)
    ],
    vary: Annotated[
        list[str],
        typer.Option(
            "--vary",
            metavar="POINTER=VALUES",
            help="Field and its values as a JSON list, as in /waypoints/1/duration=[1,2,4]; one option a field.",
        ),
    ],
    output: OutputOption,
    format_: FormatOption = None,
    url: UrlOption = None,
    workers: WorkersOption = None,
    report: ReportOption = None,
) -> None:
    """Plan a request with every combination of values of some fields; see `planner batch`."""
    import orjson

    try:
        grid = {"template": orjson.loads(template.read_bytes()), "vary": [_varied(text) for text in vary]}
    except orjson.JSONDecodeError as error:
        raise typer.BadParameter(f"not JSON: {error}", param_hint="FILE") from None
    _run(Asked(orjson.dumps({"grid": grid}), "application/json", output, format_, url, workers, report))


def _varied(text: str) -> dict[str, Any]:
    import orjson

    pointer, _, values = text.partition("=")
    try:
        found = orjson.loads(values)
    except orjson.JSONDecodeError:
        found = None
    if not isinstance(found, list):
        raise typer.BadParameter(f"{values!r} is no JSON list", param_hint="--vary")
    return {"pointer": pointer, "values": found}


def _run(asked: Asked) -> None:
    """Plan a batch, write its results, and end with 1 where an item is refused."""
    import httpx

    from cli.local_service import ServiceDidNotStart
    from cli.terminal import terminal

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
    import httpx

    from cli.local_service import local_service

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
    from cli.terminal import problem_panel, terminal

    if not answer.is_success:
        answer.read()
        terminal(stderr=True).print(problem_panel(answer.json()))
        raise typer.Exit(2)


def _followed(client: httpx.Client, location: str, console: Console) -> dict[str, Any]:
    """Show the progress of the batch until it has ended."""
    from rich import progress as bars

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
    import orjson

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
    from api.work.answers.formats import FORMATS

    content = result["content"]
    file = folder / f"{result['index']:06d}{FORMATS[form].suffix}"
    file.write_bytes(b64decode(content) if result["encoding"] == "base64" else content.encode())


def _summarise(batch: dict[str, Any], durations: list[float], folder: Path, console: Console) -> None:
    """Show the outcome of the batch, and draw a histogram of durations."""
    from cli.terminal import plain_table

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
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 3.0), layout="constrained")
    axes = figure.add_subplot()
    axes.hist(durations, bins=min(BINS, len(durations)))
    axes.set_xlabel("duration of the trajectory (s)")
    axes.set_ylabel("plans")
    figure.savefig(file)
