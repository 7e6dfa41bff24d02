"""The parser of batch bodies finds the same requests as a parser of the whole body."""

from __future__ import annotations

import asyncio
import hashlib
import json
import math
import pickle
import resource
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from api.base.byte_budget import Traffic
from api.base.errors import PayloadTooLarge, ServiceError
from api.base.settings import Settings
from api.batches.arrival import Body
from api.batches.arrival import pieces as pieces_of
from api.pool.messages import Caps, Task
from api.work.tasks.batch_bodies import of_document
from api.work.tasks.batches import read_items
from api.work.tasks.context import TaskContext

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

CAPS = Caps(max_deadline=60.0, max_waypoints=1000, max_samples=1_000_000, memory_mib=0)

NAMES = st.text(st.sampled_from('ab"\\{}[],:/ \n\u00e9'), max_size=5)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-9, 9) | NAMES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES, inner, max_size=3),
    max_leaves=12,
)


def requests_of(body: bytes) -> list[tuple[Any, str]]:
    context = TaskContext(Task("create_batch", "/v1/batches", 0.0, math.inf, body, {"most_bytes": 2**26}), CAPS)
    return list(of_document(context, 100))


@given(st.lists(VALUES, min_size=1, max_size=6), st.sampled_from([None, 0, 3]), st.booleans())
def test_a_list_of_anything(requests: list[Any], indent: int | None, ascii_only: bool) -> None:
    body = json.dumps({"grid": None, "requests": requests}, indent=indent, ensure_ascii=ascii_only).encode()
    assert requests_of(body) == [(request, f"/requests/{k}") for k, request in enumerate(requests)]


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        (b'{"requests": [{"a": 1}, {"a": }]}', "/requests/1"),
        (b'{"requests": [{"a": 1}, {"a": 1e999}]}', "/requests/1"),
        (b'{"requests": [{"a": 1}', ""),
        (b'{"requests": [{"a": "b}]}', ""),
        (b'{"requests": [{"a": 1}]]', ""),
        (b'{"requests": [{"a": [1}]}]}', ""),
        (b'{"requests": [{}]}}', ""),
        (b'{"requests": \\"[{}]}', ""),
        (b'{"requests": [{"a": 1} {"a": 2}]}', ""),
        (b']]{"requests": [{}]}', ""),
        (b'{"requests": [{"a": 1}, {"a": 2}], "requests": [{"a": 3}]}', "/requests"),
        (b'[[{"a": 1}]]', ""),
        (b'{"requests": [], "more": [{}]}', ""),
        (b"", ""),
        (b"{", ""),
        (b'"\\', ""),
    ],
)
def test_what_is_no_list_is_refused_where_it_is_not(body: bytes, pointer: str) -> None:
    with pytest.raises(ServiceError) as refused:
        requests_of(body)
    assert [fault["pointer"] for fault in refused.value.details["errors"]] == [pointer]


def varied(*pointers: str, template: Any = None, values: Any = (1,)) -> list[tuple[Any, str]]:
    vary = [{"pointer": pointer, "values": values} for pointer in pointers]
    return requests_of(json.dumps({"grid": {"template": template or TEMPLATE, "vary": vary}}).encode())


TEMPLATE = {"waypoints": [{"b": 2}, 3], "frames": {"c/d": 4, "~": 5, "~1": 6, "-1": 7}}


@pytest.mark.parametrize(
    ("pointer", "changed"),
    [
        ("/waypoints/0/b", TEMPLATE | {"waypoints": [{"b": 1}, 3]}),
        ("/waypoints/1", TEMPLATE | {"waypoints": [{"b": 2}, 1]}),
        ("/frames/c~1d", TEMPLATE | {"frames": {"c/d": 1, "~": 5, "~1": 6, "-1": 7}}),
        ("/frames/~0", TEMPLATE | {"frames": {"c/d": 4, "~": 1, "~1": 6, "-1": 7}}),
        ("/frames/~01", TEMPLATE | {"frames": {"c/d": 4, "~": 5, "~1": 1, "-1": 7}}),
        ("/frames/-1", TEMPLATE | {"frames": {"c/d": 4, "~": 5, "~1": 6, "-1": 1}}),
        ("/new", TEMPLATE | {"new": 1}),
    ],
)
def test_pointers_lead_where_rfc_6901_says(pointer: str, changed: Any) -> None:
    assert varied(pointer) == [(changed, "/grid/template")]


@pytest.mark.parametrize("step", ["-1", "00", "01", "+1", " 1", "1_0", "1.0", "2", "-", "", "\u0661", "9" * 150])
@pytest.mark.parametrize("pointer", ["/waypoints/{step}", "/waypoints/{step}/b"])
def test_what_is_no_index_leads_nowhere(step: str, pointer: str) -> None:
    with pytest.raises(ServiceError) as refused:
        varied(pointer.format(step=step))
    assert [fault["pointer"] for fault in refused.value.details["errors"]] == ["/grid/vary/0/pointer"]


def test_a_value_that_takes_away_what_another_pointer_leads_into_is_refused() -> None:
    with pytest.raises(ServiceError) as refused:
        varied("/waypoints", "/waypoints/0/b")
    assert [fault["pointer"] for fault in refused.value.details["errors"]] == ["/grid/vary/1/pointer"]
    assert varied("/waypoints", "/waypoints/0/b", values=[[{"b": 9}]])[0][0]["waypoints"] == [{"b": [{"b": 9}]}]


@pytest.mark.large_only
def test_a_hundred_thousand_requests_in_a_list_fit_into_a_worker() -> None:
    """A parser of the whole body, 52 MB, wanted 600 MB at once: it was refused as `not JSON: Not enough memory`."""
    with get_context("spawn").Pool(1) as pool:
        assert pool.apply(_count_in_a_worker) == 100_000


def _count_in_a_worker() -> int:
    limit = 1024 * 2**20
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    rows = [[k / 7.0 for k in range(6)]] * 3
    request = {"robot": "kuka_kr16_2", "waypoints": [{"kind": "joint", "position": row} for row in rows]}
    line = json.dumps(request).encode()
    body = b'{"requests": [' + b", ".join([line + b" " * (510 - len(line))] * 100_000) + b"]}"
    assert len(body) > 50_000_000
    context = TaskContext(Task("create_batch", "/v1/batches", 0.0, math.inf, body, {"most_bytes": 2**26}), CAPS)
    return sum(1 for _ in of_document(context, 100_000))


@pytest.mark.parametrize(("values", "is_taken"), [(10, True), (11, False)])
def test_the_requests_of_a_grid_have_so_many_bytes_together(values: int, is_taken: bool) -> None:
    """A template of 2.9 MB and 130 values became 378 MB in the database, and as much in the server."""
    vary = [{"pointer": "/seed", "values": list(range(100, 100 + values))}]
    template = {"robot": "ur5", "seed": 100, "x": "x" * 1000}
    body = json.dumps({"grid": {"template": template, "vary": vary}}).encode()
    most = 10 * len(json.dumps(template, separators=(",", ":")))
    context = TaskContext(Task("", "", 0.0, math.inf, body, {"most_items": 100, "most_bytes_of_all": most}), CAPS)
    if is_taken:
        assert sum(len(pickle.loads(chunk)) for chunk in read_items(context).result) == values  # noqa: S301 - made here
    else:
        with pytest.raises(PayloadTooLarge, match=f"{most}.*first 11 have {most // 10 * 11}"):
            read_items(context)


@pytest.mark.parametrize(
    ("declared", "lines", "pieces"), [(0, 2048, 2048), (0, 2049, 2048), (2048 * 1024, 2048, 2048), (2**30, 2048, 0)]
)
def test_lines_have_so_many_bytes_together(declared: int, lines: int, pieces: int) -> None:
    """Each line was bounded, not their sum. The service refuses a declared excess before it stores any line."""
    most = 2 * 2**20
    settings = Settings(max_batch_expanded_bytes=most)
    taken = bytearray()

    async def chunks() -> AsyncIterator[bytes]:
        for _ in range(lines):
            yield b"x" * 1023 + b"\n"

    async def take() -> None:
        body = Body(chunks(), True, declared, Traffic(2**30).share(""))
        async for piece in pieces_of(settings, body, hashlib.sha256()):
            taken.extend(piece)

    if pieces == lines:
        asyncio.run(take())
    else:
        with pytest.raises(PayloadTooLarge, match=str(most)):
            asyncio.run(take())
    assert len(taken) == pieces * 1024
