"""The command line of batches: `planner batch` and `planner sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import orjson
import typer

from cli.options import format_names

OutputOption = Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Folder of the results.")]
FormatOption = Annotated[
    str | None,
    typer.Option(
        "--format",
        metavar="NAME",
        help="Write each plan into a file in this form.",
        show_default="all as JSON lines",
        autocompletion=format_names,
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
    from cli.work.batch_runs import Asked, run_batch

    run_batch(Asked(requests.read_bytes(), "application/x-ndjson", output, format_, url, workers, report))


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
    try:
        grid = {"template": orjson.loads(template.read_bytes()), "vary": [_varied(text) for text in vary]}
    except orjson.JSONDecodeError as error:
        raise typer.BadParameter(f"not JSON: {error}", param_hint="FILE") from None
    from cli.work.batch_runs import Asked, run_batch

    run_batch(Asked(orjson.dumps({"grid": grid}), "application/json", output, format_, url, workers, report))


def _varied(text: str) -> dict[str, Any]:
    pointer, _, values = text.partition("=")
    try:
        found = orjson.loads(values)
    except orjson.JSONDecodeError:
        found = None
    if not isinstance(found, list):
        raise typer.BadParameter(f"must be a JSON list; got {values!r}", param_hint="--vary")
    return {"pointer": pointer, "values": found}
