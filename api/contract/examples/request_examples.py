"""Examples of bodies by operation: the document shows them, and workers run them before any request comes."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import orjson


def request_examples() -> dict[str, dict[str, Any]]:
    """Read the examples: by the id of the operation, then by their names."""
    read: dict[str, dict[str, Any]] = orjson.loads(
        files("api.contract.examples").joinpath("request_examples.json").read_bytes()
    )
    return read
