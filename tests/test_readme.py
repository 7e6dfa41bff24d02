"""What the README shows is what happens: its commands are run, its answers compared."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from api.cli.local_service import local_service
from planner.robots import catalogue_ids
from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)
CONSOLE = [text for language, text in BLOCKS if language == "console"]
CURL = [text for text in CONSOLE if text.startswith("$ curl")]
COMMANDS = [line[2:] for text in CONSOLE for line in text.splitlines() if line.startswith("$ planner")]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
ELLIPSIS = "..."


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with local_service(tmp_path_factory.mktemp("service") / "service.log", workers=1) as (url, _):
        yield url


def test_the_readme_has_its_examples() -> None:
    assert len(CURL) == 4
    assert len(COMMANDS) == 7


@pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")
@pytest.mark.parametrize("example", CURL, ids=["plan", "collision", "problem", "batch"])
def test_curl_gets_the_answer_shown(example: str, address: str) -> None:
    command, answer = re.fullmatch(r"\$ (curl .*?')\n(\{.*)", example, flags=re.DOTALL).groups()  # type: ignore[union-attr]
    assert "http://127.0.0.1:8000" in command
    arguments = shlex.split(command.replace("http://127.0.0.1:8000", address))
    real = subprocess.run(arguments, check=True, capture_output=True).stdout
    assert_shown(_parse(answer), json.loads(real))


def test_command_lines_run(tmp_path: Path) -> None:
    """In the order in which they stand: one reads what another has written."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for command in COMMANDS:
        arguments = [sys.executable, "-m", "api.cli", *command.split()[1:]]
        subprocess.run(arguments, cwd=tmp_path, env=ENVIRONMENT, check=True)
    assert (tmp_path / "refuelling.csv").read_text().startswith("time,segment,position.joint_1")
    assert "<svg" in (tmp_path / "refuelling.html").read_text()


def test_python_prints_what_is_shown() -> None:
    (code,) = (text for language, text in BLOCKS if language == "python")
    (shown,) = (text for language, text in BLOCKS if language == "text")
    ran = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, check=True, capture_output=True, text=True)
    assert ran.stdout == shown


def test_every_robot_named_is_in_the_catalogue_and_the_other_way_round() -> None:
    table = README.partition("## Robots")[2].partition("\n\nYour own")[0]
    optional = {"ur5", "panda", "xarm7"}
    named = set(re.findall(r"`([a-z0-9_]+)`", table)) - optional
    own = {path.stem for path in (ROOT / "planner/robots/data").glob("*.json")}
    assert named == own
    assert own <= set(catalogue_ids())


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)h][^)]*)\)", README):
        assert (ROOT / target).is_file(), target


def test_the_comparison_sees_differences() -> None:
    real = {"a": [1.0, 2.0, 3.0], "b": {"c": "sha256:12", "d": 1}}
    assert_shown(_parse('{"a": [1.0, "..."], "b": {"c": "sha256:..."}}'), real)
    for wrong in (
        '{"a": [1.0, 2.0]}',
        '{"a": [1.001, "..."]}',
        '{"a": ["...", 2.0]}',
        '{"b": {"c": "sha1..."}}',
        '{"e": 1}',
        '{"b": {"d": true}}',
    ):
        with pytest.raises(AssertionError):
            assert_shown(_parse(wrong), real)


def _parse(text: str) -> Any:
    """JSON whose numbers keep the digits that they are written with."""
    return json.loads(text, parse_float=Decimal)


def assert_shown(shown: Any, real: Any) -> None:
    """What is shown is in the real answer; `...` stands for what is left out, numbers are rounded."""
    match shown:
        case dict():
            assert isinstance(real, dict)
            for key, value in shown.items():
                assert key in real
                assert_shown(value, real[key])
        case list() if ELLIPSIS in shown:
            assert isinstance(real, list)
            gap = shown.index(ELLIPSIS)
            before, after = shown[:gap], shown[gap + 1 :]
            if ELLIPSIS in after:  # something in the middle
                assert not before
                (middle,) = after[:-1]
                assert any(_is_shown(middle, item) for item in real)
                return
            assert_shown(before, real[: len(before)])
            assert_shown(after, real[len(real) - len(after) :])
        case list():
            assert isinstance(real, list)
            assert len(shown) == len(real)
            for one, other in zip(shown, real, strict=True):
                assert_shown(one, other)
        case Decimal():
            digits = -int(shown.as_tuple().exponent)
            tolerance = 0.51 * 10.0**-digits if shown else 1e-6
            assert real == pytest.approx(float(shown), abs=tolerance, rel=0.0)
        case str() if shown.endswith(ELLIPSIS):
            assert real.startswith(shown.removesuffix(ELLIPSIS))
        case _:
            assert type(shown) is type(real)
            assert shown == real


def _is_shown(shown: Any, real: Any) -> bool:
    try:
        assert_shown(shown, real)
    except AssertionError:
        return False
    return True
