"""The examples of the OpenAPI document equal the answers of the service."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from pydantic import TypeAdapter

from api.base.errors import STATUS_OF_CODE
from api.contract.parts.problem_documents import ProblemDocument
from api.http.openapi import examples
from tests.api.contract import recorded_examples
from tests.api.contract.recorded_examples import differences
from tests.api.operations import OPERATIONS

if TYPE_CHECKING:
    from tests.api.conftest import RunningService


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
        assert shown.keys() == set(map(str, operation.answers)), operation.id
        for named in shown.values():
            assert named
        assert not operation.examples or shown[str(operation.answers[0])].keys() == operation.examples.keys()
        assert set(operation.codes) <= examples()["problems"].keys()


def test_what_is_not_as_shown_is_found() -> None:
    assert not differences({"a": [1.0], "id": "x"}, {"a": [1.0 + 1e-9], "id": "y", "b": 2})
    for other in ({"a": [1.1]}, {"a": [1.0, 2.0]}, {"b": [1.0]}, {"a": None}, {"a": [True]}):
        assert differences({"a": [1.0]}, other)
    tied = {"checks": [{"joint": "joint_1", "time": 1.0, "peak": 2.0}]}
    assert not differences(tied, {"checks": [{"joint": "joint_2", "time": 3.0, "peak": 2.0}]})
    assert differences(tied, {"checks": [{"joint": None, "time": 1.0, "peak": 2.0}]})
    assert differences(tied, {"checks": [{"joint": "joint_1", "time": 1.0, "peak": 3.0}]})
    assert differences("time,x\n0,1.0\n", "time,x\n0,1.1\n")
    assert differences('data: {"a": 1}\n', 'data: {"a": 2}\n')
