"""A runner of a page's examples: runs its Python blocks in order and compares their output."""

from __future__ import annotations

import contextlib
import io
import re
from typing import NamedTuple

BLOCK = re.compile(
    r"^```python\n(?P<code>.*?)^```\n(?:\n```text\n(?P<shown>.*?)^```\n)?", flags=re.DOTALL | re.MULTILINE
)


class Example(NamedTuple):
    """A block of Python and the output shown below it."""

    line: int
    code: str
    shown: str


def examples_of(page: str) -> list[Example]:
    return [
        Example(page.count("\n", 0, found.start()) + 2, found["code"], found["shown"] or "")
        for found in BLOCK.finditer(page)
    ]


def run(examples: list[Example], name: str) -> list[str]:
    """Run the examples in one namespace, in the order of the page, and return the output of each."""
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
    """Return the page with the output of each example below it."""
    outputs = iter(printed)

    def block(found: re.Match[str]) -> str:
        output = next(outputs)
        return f"```python\n{found['code']}```\n" + (f"\n```text\n{output}```\n" if output else "")

    return BLOCK.sub(block, page)
