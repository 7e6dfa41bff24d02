"""Files of plans: one line with the format and a digest, then the plan as JSON."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

from planner.plans.values import decode, encode

FORMAT = "planner-plan/1"
"""The format of files of plans; a change that makes older files unreadable raises its number."""


def write_plan(plan: Any, path: str | Path) -> None:
    """Write a plan to a file; see `Plan.save`."""
    try:
        entries = encode(plan)
    except TypeError as error:
        raise TypeError(f"the plan cannot be saved: {error}") from None
    content = json.dumps(entries, separators=(",", ":"), allow_nan=False).encode()
    Path(path).write_bytes(f"{FORMAT} {sha256(content).hexdigest()}\n".encode() + content)


def read_plan(path: str | Path) -> Any:
    """Read the value in a file that `write_plan` wrote; see `planner.load`."""
    header, _, content = Path(path).read_bytes().partition(b"\n")
    kind, _, digest = header.partition(b" ")
    if not kind.startswith(FORMAT.partition("/")[0].encode() + b"/"):
        raise ValueError(f"{path} is no plan that `Plan.save` wrote")
    if kind != FORMAT.encode():
        raise ValueError(f"{path} has the format {kind.decode(errors='replace')}; this version reads {FORMAT}")
    if sha256(content).hexdigest().encode() != digest:
        raise ValueError(f"{path} is damaged: its content does not match its digest")
    try:
        return decode(json.loads(content))
    except (ValueError, IndexError, RecursionError) as error:
        raise ValueError(f"{path} cannot be read: {error}") from None
