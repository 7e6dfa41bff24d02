"""The examples of the OpenAPI document are what the service answers."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

import pytest
from pydantic import TypeAdapter

from api.errors import STATUS_OF_CODE
from api.openapi import examples
from api.operations import OPERATIONS
from api.schemas.problem_documents import ProblemDocument
from tests.api.contract import recorded_examples

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

OF_THE_MOMENT = {"id", "created", "ended", "rate", "remaining_time", "request_hash"}
"""Fields whose values are others each time."""

FOR_PEOPLE = {"detail", "message", "explanation"}
"""Fields whose words name the robots that are installed, or a time."""


def differences(shown: Any, answered: Any, where: str = "") -> list[str]:
    """Where an answer is not as it is shown; it may have further fields."""
    if isinstance(shown, dict) and isinstance(answered, dict):
        found = [f"{where}/{name} is missing" for name in shown.keys() - answered.keys()]
        for name in shown.keys() & answered.keys():
            if name not in OF_THE_MOMENT | FOR_PEOPLE:
                found += differences(shown[name], answered[name], f"{where}/{name}")
        return found
    if isinstance(shown, list) and isinstance(answered, list) and len(shown) == len(answered):
        pairs = enumerate(zip(shown, answered, strict=True))
        return [found for i, pair in pairs for found in differences(*pair, f"{where}/{i}")]
    if isinstance(shown, float) and isinstance(answered, float):
        return [] if answered == pytest.approx(shown, rel=1e-5, abs=1e-9) else [f"{where}: {answered} for {shown}"]
    if isinstance(shown, str) and isinstance(answered, str) and parsed(shown) != shown:
        return differences(parsed(shown), parsed(answered), where)
    return [] if type(shown) is type(answered) and shown == answered else [f"{where}: {answered!r} for {shown!r}"]


def parsed(text: str) -> Any:
    """The values of lines of JSON, of events, or of a table."""
    lines = [line.removeprefix("data: ") for line in text.splitlines()]
    if any(line.startswith("{") for line in lines):
        return [json.loads(line) for line in lines if line.startswith("{")]
    if len(lines) > 1 and "," in lines[0]:
        header, *rows = csv.reader(io.StringIO(text, newline=""))
        return [header, *([float(cell) for cell in row] for row in rows)]
    return text


@pytest.fixture(scope="module")
def recorded(service: RunningService) -> dict[str, Any]:
    return recorded_examples.examples(service)


def test_answers_are_as_shown(recorded: dict[str, Any]) -> None:
    assert not differences(examples()["answers"], recorded["answers"])


def test_problems_are_as_shown(recorded: dict[str, Any]) -> None:
    shown = examples()["problems"]
    assert not differences(shown, recorded["problems"])
    assert {code: problem["status"] for code, problem in shown.items()} == STATUS_OF_CODE
    for code, problem in shown.items():
        assert problem["code"] == code
        assert problem["type"].endswith(f":{code}")
        TypeAdapter(ProblemDocument).validate_python(problem)


def test_every_status_of_every_operation_has_an_example() -> None:
    for operation in OPERATIONS:
        shown = examples()["answers"].get(operation.id, {})
        statuses = {operation.status, *operation.also} if operation.answer is not None else set()
        assert shown.keys() == set(map(str, statuses)), operation.id
        for named in shown.values():
            assert named
        assert not operation.examples or shown[str(operation.status)].keys() == operation.examples.keys()
        assert set(operation.codes) <= examples()["problems"].keys()


def test_what_is_not_as_shown_is_found() -> None:
    assert not differences({"a": [1.0], "id": "x"}, {"a": [1.0 + 1e-9], "id": "y", "b": 2})
    for other in ({"a": [1.1]}, {"a": [1.0, 2.0]}, {"b": [1.0]}, {"a": None}, {"a": [True]}):
        assert differences({"a": [1.0]}, other)
    assert differences("time,x\n0,1.0\n", "time,x\n0,1.1\n")
    assert differences('data: {"a": 1}\n', 'data: {"a": 2}\n')
