"""Damage to proof files: bytes that are no proof, and values of other kinds in place of any value of a proof."""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Any

from benchmarks.proofs.tampering import with_digests

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np

VALUES: tuple[Any, ...] = (
    *(None, "", "lower", [], {}, [[]], [0.0, 0.0], {"links": []}),
    *(0, -1, 1, 2**53 + 1, 10**30, 1e308, -1e308, 5e-324, 1e-9, 0.5, 1e9),
)
"""Values in place of others; all of them have a digest."""

WORDS = ("NaN", "Infinity", "-Infinity", "1e999", "-1e999", "9" * 400, "9" * 5000, "0x10", "01", "true", "1.", "--1")
"""Words in place of a number; none of them is a number of the format."""


def damaged_text(text: str, generator: np.random.Generator) -> bytes:
    """Return the bytes of a file with damage below the level of values."""
    place = int(generator.integers(len(text)))
    kind = int(generator.integers(7))
    if kind == 0:
        return text[:place].encode()
    if kind == 1:
        raw = bytearray(text.encode())
        raw[place] = int(generator.integers(256))
        return b"" if has_the_values_of(text, bytes(raw)) else bytes(raw)
    if kind == 2:
        return (b"[", b'{"a":')[place % 2] * int(10 ** generator.uniform(3, 6))
    if kind == 3:
        twice = f'"claims": {json.dumps(VALUES[place % 4])}, "claims":'
        return text.replace('"claims":', twice, 1).encode()
    if kind == 4:
        start = text.index(": ", place if place < len(text) // 2 else 0)
        return (text[: start + 2] + str(generator.choice(WORDS)) + ", " + text[start + 2 :]).encode()
    if kind == 5:
        return text.replace('"joint_names": ["', '"joint_names": ["\\ud800', 1).encode()
    return text.replace(":", str(generator.choice(["::", "\x00", "\ufeff", " "])) if place % 2 else "", 1).encode()


def has_the_values_of(text: str, raw: bytes) -> bool:
    """Tell whether bytes have the values of a text: they may differ in spaces and in digits below rounding."""
    try:
        return bool(json.loads(raw) == json.loads(text))
    except ValueError:
        return False


def places_of(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each list or object that has a value, and the index or key of it."""
    for key, each in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield value, key
        yield from places_of(each)


def damaged_values(proof: dict[str, Any], generator: np.random.Generator) -> dict[str, Any]:
    """Return a proof in which a value is another one, missing or there twice, with digests written anew."""
    changed = copy.deepcopy(proof)
    places = list(places_of({name: changed[name] for name in ("statement", "trajectory", "evidence")}))
    # Values near the root are few and weigh more.
    small = [place for place in places if isinstance(place[0][place[1]], dict | list | str)]
    chosen = small if generator.random() < 0.7 else places
    where, key = chosen[int(generator.integers(len(chosen)))]
    kind = int(generator.integers(3))
    if kind == 0:
        where[key] = copy.deepcopy(VALUES[int(generator.integers(len(VALUES)))])
    elif kind == 1:
        del where[key]
    elif isinstance(where, list):
        where.insert(key, copy.deepcopy(where[key]))
    else:
        where[key] = [where[key]]
    return with_digests(changed)
