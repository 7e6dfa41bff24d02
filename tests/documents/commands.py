"""Commands of the pages: parsed from their text, run against a service, compared with the shown output."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from contextlib import ExitStack
from textwrap import dedent
from typing import TYPE_CHECKING

from cli.local_service import local_service
from tests.documents.shown_answers import assert_shown, parse_shown
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

ADDRESS = "http://127.0.0.1:8000"
"""The address of the service in the pages."""


def commands_of(text: str) -> list[tuple[str, str]]:
    """Return the commands of a page, each with the output that the page shows."""
    found = []
    for block in re.findall(r"^ *```console\n(.*?)^ *```$", text, flags=re.DOTALL | re.MULTILINE):
        example = dedent(block).removeprefix("$ ")
        command, shown = (example, "") if "<<'END'" in example else _split(example)
        found.append((command, shown))
    return found


def _split(example: str) -> tuple[str, str]:
    """Split an example after its command, which ends with the line that closes its quotes."""
    lines = example.splitlines(keepends=True)
    end = next(k for k in range(1, len(lines) + 1) if "".join(lines[:k]).count("'") % 2 == 0)
    return "".join(lines[:end]), "".join(lines[end:])


def settings_of(text: str, folder: Path) -> dict[str, str]:
    """Return the settings with which a page starts the service; `$PWD` is the folder."""
    started = re.findall(r"^ *((?:PLANNER_\w+=\S+ )+)planner serve$", text, flags=re.MULTILINE)
    pairs = (pair.split("=", 1) for pair in " ".join(started).split())
    return {name: value.replace("$PWD", str(folder)) for name, value in pairs}


def run_page(text: str, folder: Path, shared: str) -> None:
    """Run the commands of a page in a folder, and compare their output.

    Args:
        text: The page.
        folder: An empty folder.
        shared: The URL of the service for a page that starts none with settings.
    """
    programs = folder / "bin"
    programs.mkdir()
    (programs / "planner").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m cli "$@"\n', encoding="utf-8")
    (programs / "planner").chmod(0o755)
    settings = settings_of(text, folder)
    environment = os.environ | settings
    environment |= {"PATH": f"{programs}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    with ExitStack() as stack:
        address = shared
        if settings:
            address, _ = stack.enter_context(local_service(folder / "service.log", workers=1, settings=settings))
        for command, shown in commands_of(text):
            ran = subprocess.run(
                ["bash", "-euc", command.replace(ADDRESS, address)],
                cwd=folder,
                env=environment,
                check=True,
                capture_output=True,
                text=True,
            )
            if shown.startswith("{"):
                assert_shown(parse_shown(shown), json.loads(ran.stdout))
            else:
                assert ran.stdout.strip() == shown.strip(), command
