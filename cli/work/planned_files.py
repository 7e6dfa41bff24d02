"""Plans of request files without a service, and checks of their proofs: `planner plan` and `planner check`."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import orjson
import typer

from cli.work.local_plan import plan_request, read_request, render, report_of
from cli.work.pictures import SUFFIXES, draw
from cli.work.robots.files import FileOptions
from cli.work.saved_plans import chosen_format
from cli.work.shared import read, refusals, robot_named, write
from cli.work.terminal import plan_summary, terminal
from planner.backends import BACKENDS
from planner.proofs import ProofRejected, check_proof, write_proof


def plan_file(
    request: str,
    output: str | None,
    format_: str | None,
    plot: Path | None,
    report: Path | None,
    proof: Path | None,
    save: Path | None,
    backend: str | None,
    robot: str | None,
    srdf: Path | None,
    tip: str | None,
) -> None:
    """Plan the request in a file, show the plan and write files; see `planner plan`."""
    form = chosen_format(output or ".json", format_)
    if plot is not None and plot.suffix not in SUFFIXES:
        raise typer.BadParameter(f"must end with one of {', '.join(SUFFIXES)}", param_hint="--plot")
    if backend is not None and backend not in BACKENDS:
        raise typer.BadParameter(f"must be one of {', '.join(BACKENDS)}", param_hint="--backend")
    text = read(request)
    with refusals():
        named = None if robot is None else robot_named(robot, FileOptions(srdf, tip))
        asked = read_request(text, backend, None if named is None else named.id)
        start = time.perf_counter()
        solved = plan_request(asked, None if named is None else named.load())
        seconds = time.perf_counter() - start
        definition = None if named is None else named.definition
        written = b"" if output is None else render(solved, asked, form, definition)
        title = Path(request).stem.replace("_", " ") if request != "-" else "Plan"
        proved = b"" if proof is None else orjson.dumps(write_proof(solved))
        reported = b"" if report is None else report_of(solved, asked, title, definition)
    console = terminal(stderr=output == "-")
    console.print(plan_summary(solved, seconds))
    if output == "-":
        sys.stdout.buffer.write(written)
    elif output is not None:
        write(Path(output), written, console)
    if report is not None:
        write(report, reported, console)
    if proof is not None:
        write(proof, proved, console)
    if save is not None:
        try:
            solved.save(save)
        except OSError as error:
            raise typer.BadParameter(f"{save}: {error.strerror}", param_hint="--save") from None
        console.print(f"saved {save}")
    if plot is not None:
        write(plot, draw(solved, asked, title, plot.suffix, seconds), console)


def check_proof_file(file: str, statement: str | None, trajectory: str | None) -> None:
    """Check a proof file and print its claims; end with 1 if it is rejected."""
    try:
        text = read(file, "PROOF")
        content = json.loads(text)
        is_answer = isinstance(content, dict) and "proof" in content
        proof = content["proof"] if is_answer else content
        claims = check_proof(proof if is_answer else text, {"statement": statement, "trajectory": trajectory})
    except (ProofRejected, ValueError, RecursionError) as error:
        typer.echo(f"rejected: {error}", err=True)
        raise typer.Exit(1) from None
    typer.echo(f"accepted: {', '.join(claims)}")
    for claim in proof["statement"]["not_covered"]:
        typer.echo(f"not covered: {claim}")
    for part, digest in proof["digests"].items():
        typer.echo(f"{part} {digest}")
