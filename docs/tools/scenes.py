"""The pictures of scenes that docs/collisions.md shows, each by the command that stands below it.

Run: python -m docs.tools.scenes
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/collisions.md"
IMAGES = ROOT / "docs/images/scenes"

SHOWN = re.compile(r"!\[[^]]*\]\(images/scenes/(\w+)\.png\)\n\n`planner ([^`]*) -o \1\.png`\n")
"""A picture on the page, and the command that draws it."""


def commands() -> dict[str, list[str]]:
    """Return the arguments of `planner` that draw each picture of the page, by its name."""
    return {name: shlex.split(command) for name, command in SHOWN.findall(PAGE.read_text(encoding="utf-8"))}


def main() -> None:
    """Draw the pictures."""
    from typer.testing import CliRunner

    from cli import app

    IMAGES.mkdir(parents=True, exist_ok=True)
    for name, command in commands().items():
        CliRunner().invoke(app, [*command, "-o", str(IMAGES / f"{name}.png")], catch_exceptions=False)


if __name__ == "__main__":
    main()
