"""The tutorial from top to bottom: every command runs, and every shown answer is real."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from typing import TYPE_CHECKING

import pytest

from cli.local_service import local_service
from tests.documents.shown_answers import assert_shown, parse_shown
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

TUTORIAL = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```console\n\$ (.*?)^```", TUTORIAL, flags=re.DOTALL | re.MULTILINE)


@pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")
def test_the_tutorial_does_what_it_shows(tmp_path: Path) -> None:
    assert len(EXAMPLES) > 12
    with local_service(tmp_path / "service.log", workers=1) as (address, _):
        for example in EXAMPLES:
            command, _, shown = example.partition("\n")
            if "<<'END'" in command:
                command, shown = example, ""
            ran = subprocess.run(
                ["bash", "-euc", command.replace("http://127.0.0.1:8000", address)],
                cwd=tmp_path,
                check=True,
                capture_output=True,
                text=True,
            )
            if shown.startswith("{"):
                assert_shown(parse_shown(shown), json.loads(ran.stdout))
            else:
                assert ran.stdout == shown, command


def test_the_comparison_sees_differences() -> None:
    real = {"a": [1.0, 2.0, 3.0], "b": {"c": "sha256:12", "d": 1}}
    assert_shown(parse_shown('{"a": [1.0, "..."], "b": {"c": "sha256:..."}}'), real)
    for wrong in (
        '{"a": [1.0, 2.0]}',
        '{"a": [1.001, "..."]}',
        '{"a": ["...", 2.0]}',
        '{"b": {"c": "sha1..."}}',
        '{"e": 1}',
        '{"b": {"d": true}}',
    ):
        with pytest.raises(AssertionError):
            assert_shown(parse_shown(wrong), real)
