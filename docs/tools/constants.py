"""Makes docs/constants.md: the accuracy constants of the library, with value, unit, meaning and place.

Run: python -m docs.tools.constants > docs/constants.md
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

ROOT = Path(__file__).parents[2]
MOST = 1e-4
"""Largest value of a number that counts as an accuracy, wherever it stands."""

TOLERANCES = "planner/tolerances.py"
"""File in which all numbers are accuracies."""

HEADER = f"""\
# Accuracy constants

Made by `python -m docs.tools.constants > docs/constants.md`; `python -m tests.lint` checks that it is current.

The table lists the constants of `{TOLERANCES}`, which several modules share, and all other numbers of the library
of at most {MOST:g}. `tests/planner/test_accuracies.py` halves and doubles each of them: all certificates of a small
corpus are satisfied. The unit 1 is that of a ratio; - means that the meaning names no unit.

| name | value | unit | meaning | place |
|---|---|---|---|---|
"""
UNIT = re.compile(r"\b(rad or m|m or rad|m, rad|rad and m|m/s|N m/kg|kg m\^2|rad|m|s)\b(?=[,.:;)]| up to| below| that)")
RATIO = re.compile(r"\b(relative|ratio|share|factor|cosine|sine|in unit time|solver's unit)\b", re.IGNORECASE)


@dataclass(frozen=True)
class Constant:
    """A number at the level of a module."""

    name: str
    value: float
    meaning: str
    file: str

    @property
    def unit(self) -> str:
        """The unit that the meaning names; 1 for a ratio."""
        ratio, unit = RATIO.search(self.meaning), UNIT.search(self.meaning)
        if ratio and (unit is None or ratio.start() < unit.start()):
            return "1"
        return unit[1] if unit else "-"


def constants_of(tree: ast.Module) -> Iterator[tuple[ast.Assign | ast.AnnAssign, list[ast.expr], str | None]]:
    """Yield the assignments at the level of a module, their targets, and the docstring below each."""
    for node, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets: list[ast.expr] = list(node.targets) if isinstance(node, ast.Assign) else [node.target]
            match after:
                case ast.Expr(value=ast.Constant(value=str(docstring))):
                    yield node, targets, docstring
                case _:
                    yield node, targets, None


def is_number(value: ast.expr | None) -> bool:
    """Return whether a value is a number, or several, written with numbers and pi alone."""
    match value:
        case ast.Constant(value=number):
            return isinstance(number, int | float) and not isinstance(number, bool)
        case ast.BinOp(left=left, right=right):
            return is_number(left) and is_number(right)
        case ast.UnaryOp(operand=operand):
            return is_number(operand)
        case ast.Tuple(elts=elements):
            return all(map(is_number, elements))
        case ast.Attribute(attr="pi"):
            return True
        case _:
            return False


def accuracies(files: Iterable[tuple[str, ast.Module]]) -> list[Constant]:
    """Find the accuracy constants of files, given by name and tree."""
    found = []
    for file, tree in files:
        for node, targets, docstring in constants_of(tree):
            match targets, node.value:
                case [ast.Name(id=name)], ast.Constant(value=float(value)):
                    if name.isupper() and (file == TOLERANCES or 0.0 < value <= MOST):
                        found.append(Constant(name, value, " ".join((docstring or "").split()), file))
    return sorted(found, key=lambda constant: (constant.file != TOLERANCES, constant.name, constant.file))


def library() -> Iterator[tuple[str, ast.Module]]:
    """Yield the files of the library with their trees."""
    for file in sorted((ROOT / "planner").rglob("*.py")):
        yield str(file.relative_to(ROOT)), ast.parse(file.read_text(encoding="utf-8"))


def document(found: Iterable[Constant]) -> str:
    """Return the page."""
    rows = (
        f"| `{it.name}` | {it.value:g} | {it.unit} | {it.meaning.replace('|', chr(92) + '|')} | `{it.file}` |\n"
        for it in found
    )
    return HEADER + "".join(rows)


if __name__ == "__main__":
    print(document(accuracies(library())), end="")
