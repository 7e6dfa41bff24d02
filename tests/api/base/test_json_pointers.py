"""JSON pointers: writing, reading and putting values, against the examples of RFC 6901."""

from __future__ import annotations

from typing import Any

import pytest

from api.base.json_pointers import NothingThere, changed, steps_of, to_pointer


@pytest.mark.parametrize(
    ("pointer", "steps"),
    [("", []), ("/foo/0", ["foo", "0"]), ("/", [""]), ("/a~1b", ["a/b"]), ("/m~0n", ["m~n"]), ("/~01", ["~1"])],
)
def test_pointers_are_read_and_written_as_rfc_6901_says(pointer: str, steps: list[str]) -> None:
    assert steps_of(pointer) == steps
    assert to_pointer(steps) == pointer


@pytest.mark.parametrize(
    ("pointer", "expected"),
    [
        ("/a/1", {"a": [1, 9], "n": None}),
        ("/n/x/y", {"a": [1, 2], "n": {"x": {"y": 9}}}),
        ("/new/-1", {"a": [1, 2], "n": None, "new": {"-1": 9}}),
    ],
)
def test_a_copy_is_changed_and_left_out_objects_are_made(pointer: str, expected: Any) -> None:
    document = {"a": [1, 2], "n": None}
    assert changed(document, pointer, 9) == expected
    assert document == {"a": [1, 2], "n": None}


@pytest.mark.parametrize("pointer", ["/a/2", "/a/-1", "/a/01", "/a/x", "/a/0/x"])
def test_a_pointer_to_no_entry_of_an_array_is_refused(pointer: str) -> None:
    with pytest.raises(NothingThere):
        changed({"a": [1, 2]}, pointer, 9)
