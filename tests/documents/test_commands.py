"""The tutorial and the how-to guides: every command runs, and every shown answer is real."""

from __future__ import annotations

import re
import shutil
from typing import TYPE_CHECKING

import pytest

from api.base.settings import Settings
from tests.documents.commands import commands_of, run_page, settings_of
from tests.documents.shown_answers import assert_shown, parse_shown
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from tests.api.conftest import RunningService

DOCS = ROOT / "docs"
GUIDES = sorted(page for page in (DOCS / "how_to").glob("*.md") if page.name != "index.md")
SIZES = {"k": 2**10, "m": 2**20, "g": 2**30}


needs_curl = pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")


def print_what_they_show(page: Path, folder: Path, service: RunningService) -> None:
    """Assert that the commands of a page print the shown answers."""
    text = page.read_text(encoding="utf-8")
    assert len(commands_of(text)) >= 2
    run_page(text, folder, service.url)


@pytest.mark.large_only
@needs_curl
def test_commands_of_the_tutorial_print_the_shown_output(tmp_path: Path, service: RunningService) -> None:
    print_what_they_show(DOCS / "tutorial.md", tmp_path, service)


@needs_curl
@pytest.mark.large_only
@pytest.mark.parametrize("page", GUIDES, ids=lambda page: page.stem)
def test_commands_of_guides_print_the_shown_output(page: Path, tmp_path: Path, service: RunningService) -> None:
    print_what_they_show(page, tmp_path, service)


def test_the_index_lists_every_guide() -> None:
    index = (DOCS / "how_to" / "index.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"\]\((\w+\.md)\)", index)) == [page.name for page in GUIDES]


def test_the_navigation_has_every_page_once() -> None:
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    entries = re.findall(r"([\w/]+\.md)$", text.split("\nnav:")[1].split("\nmarkdown_extensions:")[0], re.MULTILINE)
    assert sorted(entries) == sorted(str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md"))


def test_named_settings_exist() -> None:
    known = {f"PLANNER_{name.upper()}" for name in Settings.model_fields}
    for page in GUIDES:
        assert set(re.findall(r"PLANNER_[A-Z_]+", page.read_text(encoding="utf-8"))) <= known, page.name


def test_nginx_passes_every_body_and_waits_for_every_answer() -> None:
    text = (DOCS / "how_to" / "proxy.md").read_text(encoding="utf-8")
    bounds = Settings(data_directory=None)
    ((number, unit),) = re.findall(r"client_max_body_size (\d+)([kmg]);", text)
    assert int(number) * SIZES[unit] >= bounds.max_body_bytes
    ((seconds,),) = [re.findall(r"proxy_read_timeout (\d+)s;", text)]
    assert float(seconds) > bounds.max_deadline


def test_commands_end_where_their_quotes_close(tmp_path: Path) -> None:
    text = '```console\n$ curl --json \'{\n  "a": 1}\'\n{"b": 2}\n```\n\n    ```console\n    $ echo x\n    x\n    ```\n'
    assert commands_of(text) == [("curl --json '{\n  \"a\": 1}'\n", '{"b": 2}\n'), ("echo x\n", "x\n")]
    assert settings_of("    PLANNER_A=$PWD/x PLANNER_B=2 planner serve\n", tmp_path) == {
        "PLANNER_A": f"{tmp_path}/x",
        "PLANNER_B": "2",
    }


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
