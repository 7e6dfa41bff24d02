"""Problem documents of planning problems: pointers into the request."""

from __future__ import annotations

import pytest

from api.work.answers.problem_documents import pointer_of
from planner import FieldPath


@pytest.mark.parametrize(
    ("field", "pointer"),
    [
        ((), ""),
        (("waypoints", 1, "duration"), "/waypoints/1/duration"),
        (("inverse_kinematics", "reference"), "/ik/reference"),
        (("frames", "pallet/left~1"), "/frames/pallet~1left~01"),
    ],
)
def test_fields_are_pointed_to_as_rfc_6901_says(field: FieldPath, pointer: str) -> None:
    assert pointer_of(field) == pointer
