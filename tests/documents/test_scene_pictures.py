"""The pictures of docs/collisions.md: each has its command, which draws the scene of its request."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from cli import app
from docs.tools.scenes import IMAGES, PAGE, commands
from tests.documents.read_pictures import drawn_groups
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

COMMANDS = commands()


def test_every_picture_has_its_command() -> None:
    shown = re.findall(r"\(images/scenes/(\w+)\.png\)", PAGE.read_text(encoding="utf-8"))
    assert shown == list(COMMANDS)
    assert sorted(path.stem for path in IMAGES.iterdir()) == sorted(COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_picture_shows_what_stands_around(name: str, tmp_path: Path) -> None:
    path = tmp_path / "picture.svg"
    result = CliRunner().invoke(app, [*COMMANDS[name], "-o", str(path)])
    assert result.exit_code == 0, result.output
    request = json.loads((ROOT / COMMANDS[name][1]).read_text(encoding="utf-8"))
    names = {group.split(".")[1] for group in drawn_groups(path.read_bytes()) if group.startswith("scene.")}
    assert {thing["id"] for thing in request["scene"]["objects"]} <= names
    assert {thing["id"] for thing in request["scene"].get("attached", [])} <= names
