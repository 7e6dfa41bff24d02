"""Text of path files: bounded, with strict numbers, and faults that name the line."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

from planner.errors import InvalidProblem

LengthUnit = Literal["mm", "m", "inch"]
"""Names of units of length."""

METRES: dict[str, float] = {"mm": 1e-3, "m": 1.0, "inch": 0.0254}
"""The units of length in m."""

AngleUnit = Literal["rad", "deg"]
"""Names of units of angle."""

RADIANS: dict[str, float] = {"rad": 1.0, "deg": math.pi / 180.0}
"""The units of angle in rad."""

MOST_BYTES = 16 * 2**20
"""The most bytes of a path file."""

MOST_STEPS = 10_000
"""The most lines, arcs and rows of a path file."""

FARTHEST = 1e4
"""The largest coordinate of a path file, in m, rad, or m/s: it keeps all products finite."""

MOST_FAULTS = 20
"""The most faults that a refusal of a path file lists."""

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
"""A decimal number."""


def text_of(content: bytes) -> str:
    """Decode a path file; bytes that are not UTF-8, as in old comments, become replacement characters."""
    return content.decode("utf-8-sig", errors="replace")


def read_bytes(path: Path) -> bytes:
    """Read a path file, or as much of it as shows that it is too large.

    Raises:
        OSError: The file cannot be read.
    """
    with path.open("rb") as file:
        return file.read(MOST_BYTES + 1)


def bounded(content: bytes) -> bytes:
    """Return the content of a path file.

    Raises:
        InvalidProblem: It is too large.
    """
    if len(content) > MOST_BYTES:
        raise refused(f"must have at most {MOST_BYTES // 2**20} MiB. Split the file.")
    return content


def parse_number(text: str, name: str, unit: float) -> float:
    """Parse a finite number and convert it to SI units.

    Args:
        text: The number.
        name: The word or column that has it.
        unit: Its unit, in SI units.

    Raises:
        ValueError: It is no number, or too large.
    """
    if not NUMBER.fullmatch(text.strip()):
        raise ValueError(f"`{name}` must be a number with a decimal point; got {text[:40]!r}.")
    value = float(text) * unit
    if not abs(value) <= FARTHEST:
        raise ValueError(f"`{name}` must be at most {FARTHEST:g} in SI units; got {text[:40]}. Check the units.")
    return value


def refused(*messages: str, field: str = "path") -> InvalidProblem:
    """Return the error for a path file, or another argument, with the reasons."""
    return InvalidProblem([((field,), message) for message in messages[:MOST_FAULTS]])


def listed_lines(lines: Sequence[int]) -> str:
    """Write the first numbers of lines."""
    shown = ", ".join(map(str, lines[:3]))
    return f"line{'s' if len(lines) > 1 else ''} {shown}{' and others' if len(lines) > 3 else ''}"


def check_choice(field: str, value: object, choices: object) -> None:
    """Check that an argument is one of the names of a type.

    Raises:
        InvalidProblem: It is not.
    """
    names = get_args(choices)
    if value not in names:
        raise refused(f"must be one of {', '.join(names)}; got {value!r}.", field=field)
