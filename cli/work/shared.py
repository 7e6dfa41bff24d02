"""What several commands do: read and write files, find a robot, show a problem."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import orjson
import typer

from api.base.errors import ServiceError
from api.work.answers.problem_documents import problem_document
from cli.work.robots.files import NO_OPTIONS, named_robot
from cli.work.terminal import problem_panel, terminal
from planner.errors import PlanningError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from cli.work.robots.files import FileOptions, NamedRobot


def read(name: str, parameter: str = "REQUEST") -> bytes:
    """Read a file, or stdin where the name is `-`."""
    if name == "-":
        return sys.stdin.buffer.read()
    try:
        return Path(name).read_bytes()
    except OSError as error:
        raise typer.BadParameter(f"{name}: {error.strerror}", param_hint=parameter) from None


def write(path: Path, content: bytes, console: Console) -> None:
    """Write a file and say so."""
    try:
        path.write_bytes(content)
    except OSError as error:
        raise typer.BadParameter(f"{path}: {error.strerror}", param_hint="FILE") from None
    console.print(f"wrote {path} ({len(content) / 1e3:.0f} kB)")


def robot_named(name: str, options: FileOptions = NO_OPTIONS) -> NamedRobot:
    """Find the robot of a name: a file, or an id of the catalogue."""
    try:
        return named_robot(name, options)
    except OSError as error:
        raise typer.BadParameter(f"{error.filename}: {error.strerror}", param_hint="ROBOT") from None
    except UnicodeDecodeError as error:
        raise typer.BadParameter(f"must be text in UTF-8: {error}", param_hint="ROBOT") from None


@contextmanager
def refusals() -> Iterator[None]:
    """Show the problem where there is one, and end with status 1."""
    try:
        yield
    except (PlanningError, ServiceError) as error:
        _, document = problem_document(error, instance="")
        terminal(stderr=True).print(problem_panel(orjson.loads(document)))
        raise typer.Exit(1) from None
