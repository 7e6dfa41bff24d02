"""An oversized body with any content costs a worker no more than its caps allow."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

import orjson
import pytest
from hypothesis import given
from hypothesis import strategies as st

from api.base.errors import InvalidRequest
from api.base.size import MOST_DEEP, is_too_deep, parse_json, refuse_many_rows, size_faults
from api.contract.kinematics import ForwardKinematicsRequest, InverseKinematicsRequest
from api.contract.requests import CompareRequest, PlanRequest, ValidateRequest
from api.contract.robots import RobotDefinition
from api.pool.messages import Caps
from api.work.tasks import context
from tests.api.requests import dh_joint, dh_robot, joint, plan_request, validate_request

if TYPE_CHECKING:
    from pydantic import ValidationError

CAPS = Caps(max_deadline=60.0, max_waypoints=10, max_samples=2000, memory_mib=1024)
MOST_WORK = 20_000
"""Limit of the faults found and of the functions called: several per entry that the caps allow.

The bodies below are a hundred times larger; ten or more per entry would exceed the limit."""
MANY = 200_000


def forward(positions: Any) -> dict[str, Any]:
    return {"robot": "three_dof_arm", "positions": positions}


NESTED = {str(i): {str(j): {str(k): {} for k in range(60)} for j in range(60)} for i in range(60)}
HOSTILE = {
    "empty rows": (ForwardKinematicsRequest, forward([[]] * MANY)),
    "as many empty rows as allowed": (ForwardKinematicsRequest, forward([[]] * CAPS.max_samples)),
    "rows of text": (ForwardKinematicsRequest, forward([["a"]] * CAPS.max_samples)),
    "one row of text": (ForwardKinematicsRequest, forward([["a"] * MANY])),
    "objects for rows": (ForwardKinematicsRequest, forward([{}] * MANY)),
    "times of text": (ValidateRequest, {"robot": "a", "samples": {"time": ["a"] * CAPS.max_samples, "position": []}}),
    "empty waypoints": (PlanRequest, plan_request(waypoints=[{}] * MANY)),
    "numbers for waypoints": (PlanRequest, plan_request(waypoints=[1] * MANY)),
    "numbers for poses": (InverseKinematicsRequest, {"robot": "a", "poses": [1] * MANY}),
    "numbers for back ends": (CompareRequest, plan_request(backends=[1] * MANY)),
    "unknown fields": (PlanRequest, plan_request() | {f"x{i}": 1 for i in range(MANY)}),
    "unknown fields of a waypoint": (PlanRequest, plan_request(waypoints=[{str(i): 1 for i in range(MANY)}])),
    "empty joints of a table": (RobotDefinition, dh_robot(joints=[{}] * MANY)),
    "a tree of objects": (PlanRequest, plan_request(limits=NESTED)),
}


@pytest.mark.long_table
@pytest.mark.parametrize("name", HOSTILE)
def test_the_work_on_a_hostile_body_is_bounded(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    schema, document = HOSTILE[name]
    body = orjson.dumps(document)
    done = 0

    def invalid_request(error: ValidationError, document: Any) -> InvalidRequest:
        nonlocal done
        done += error.error_count()
        return InvalidRequest("counted")

    def count(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal done
        done += event in ("call", "c_call")

    monkeypatch.setattr(context, "invalid_request", invalid_request)
    with pytest.raises(InvalidRequest):
        context.validated(schema, {}, CAPS)  # a schema is made when it is first used
    done = 0
    sys.setprofile(count)
    try:
        with pytest.raises(InvalidRequest):
            context.validated(schema, parse_json(body), CAPS)
    finally:
        sys.setprofile(None)
    assert done < MOST_WORK


def test_what_is_too_large_is_named() -> None:
    def faults(document: Any) -> dict[str, str]:
        return {
            fault["pointer"]: fault["message"] for fault in size_faults(document, CAPS.max_waypoints, CAPS.max_samples)
        }

    assert faults(plan_request(waypoints=[joint(0.0)] * 11)) == {"/waypoints": "must have at most 10 entries; got 11"}
    assert faults(forward([[0.0]] * 2001)) == {"/positions": "must have at most 2000 entries; got 2001"}
    wide = {"a/b~": {str(i): 0 for i in range(65)}}
    assert faults({"x": [wide]}) == {"/x/0/a~1b~0": "must have at most 64 fields; got 65"}
    assert faults(NESTED) == {"": "must have at most 1200 nested arrays and objects"}


def test_what_is_not_too_large_is_let_through() -> None:
    for document in (
        plan_request(waypoints=[joint(0.0)] * 10),
        forward([[0.0]] * 2000),
        validate_request(),
        dh_robot(joints=[dh_joint()] * 64),
    ):
        assert size_faults(document, CAPS.max_waypoints, CAPS.max_samples) == []


def test_rows_are_counted_before_the_body_is_parsed() -> None:
    most = 100 // 20
    refuse_many_rows(b'{"a": [[1], [2], [3]]}', 100)
    for body in (b'{"a": [[1], [2], {"b": []}]}', b"[" * (most + 1)):
        with pytest.raises(InvalidRequest, match="at most 5 JSON arrays"):
            refuse_many_rows(body, 100)
    rows = b",".join([b"[0.1,-0.2,0.3]"] * 30_000)  # of three joints, written as short as can be
    refuse_many_rows(b'{"robot": "three_dof_arm", "positions": [%s]}' % rows, 1_000_000)


TEXTS = st.text(st.sampled_from('ab"\\{}[],: \n\u00e9'), max_size=6)
DOCUMENTS = st.recursive(
    st.none() | st.integers(-9, 9) | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=12,
)


def depth_of(value: Any) -> int:
    children = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return 0 if children is None else 1 + max(map(depth_of, children), default=0)


@given(DOCUMENTS, st.integers(0, MOST_DEEP), st.booleans(), st.sampled_from([None, 1]))
def test_a_body_is_too_deep_where_a_parser_finds_it_so(value: Any, more: int, ascii_only: bool, indent: Any) -> None:
    """Brackets in strings, escaped quotes and escaped backslashes before quotes do not count."""
    for k in range(more):
        value = [value, "]"] if k % 2 else {"[": value}
    body = json.dumps(value, ensure_ascii=ascii_only, indent=indent).encode()
    assert is_too_deep(body) == (depth_of(value) > MOST_DEEP)


@pytest.mark.parametrize("start", ['{"a":', "[", '[{"a":', '{"a":['])
@pytest.mark.parametrize("times", [MOST_DEEP + 1, 300, 100_000])
def test_a_body_that_nests_too_deep_is_refused_before_it_is_parsed(start: str, times: int) -> None:
    end = "".join({"[": "]", "{": "}"}[sign] for sign in reversed(start) if sign in "[{")
    with pytest.raises(InvalidRequest, match="32 arrays and objects in one another"):
        parse_json((start * times + "1" + end * times).encode())


@pytest.mark.parametrize("body", ["[" * 100, "]" * 100, '["' + "[" * 100, '["\\', '"\\"', "{]" * 40 + "}["])
def test_what_is_no_json_is_left_to_the_parser(body: str) -> None:
    with pytest.raises(InvalidRequest, match="not JSON"):
        parse_json(body.encode())
