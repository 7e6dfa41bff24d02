"""Runs the examples of a page: its blocks of Python one after the other, and compares what they print."""

from __future__ import annotations

import contextlib
import io
import re
from typing import NamedTuple

BLOCK = re.compile(
    r"^```python\n(?P<code>.*?)^```\n(?:\n```text\n(?P<shown>.*?)^```\n)?", flags=re.DOTALL | re.MULTILINE
)


class Example(NamedTuple):
    """A block of Python, and what stands below it as its output."""

    line: int
    code: str
    shown: str


def examples_of(page: str) -> list[Example]:
    return [
        Example(page.count("\n", 0, found.start()) + 2, found["code"], found["shown"] or "")
        for found in BLOCK.finditer(page)
    ]


def run(examples: list[Example], name: str) -> list[str]:
    """What each prints, run in one namespace, as on a page that is read from top to bottom."""
    namespace: dict[str, object] = {"__name__": name}
    printed = []
    for example in examples:
        output = io.StringIO()
        code = compile("\n" * (example.line - 1) + example.code, name, "exec")
        with contextlib.redirect_stdout(output):
            exec(code, namespace)  # noqa: S102 - a page of ours
        printed.append(output.getvalue())
    return printed


def with_outputs(page: str, printed: list[str]) -> str:
    """Return the page with what the examples print below them."""
    outputs = iter(printed)

    def block(found: re.Match[str]) -> str:
        output = next(outputs)
        return f"```python\n{found['code']}```\n" + (f"\n```text\n{output}```\n" if output else "")

    return BLOCK.sub(block, page)
