"""JSON pointers: writing, reading and changing values, against the examples of RFC 6901."""

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


def test_a_changed_document_shares_the_parts_beside_the_way() -> None:
    document = {"a": [{"b": 1}, {"c": [2]}], "d": {"e": 3}}
    copied = changed(document, "/a/0/b", 9)
    assert copied == {"a": [{"b": 9}, {"c": [2]}], "d": {"e": 3}}
    assert copied["d"] is document["d"] and copied["a"][1] is document["a"][1]
    assert changed(document, "", 9) == 9


@pytest.mark.parametrize("pointer", ["/a/2", "/a/-1", "/a/01", "/a/x", "/a/0/x", "/n/0/x"])
def test_a_pointer_to_no_entry_of_an_array_is_refused(pointer: str) -> None:
    with pytest.raises(NothingThere):
        changed({"a": [1, 2], "n": [None]}, pointer, 9)
