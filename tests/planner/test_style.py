"""The house style of the library, as far as a program can hold it: names, constants, and sizes of files and folders."""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING

import pytest

from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

FILES = sorted((ROOT / "planner").rglob("*.py"))
"""Every module of the library."""

SERVICE_FILES = sorted(file for package in ("api", "cli") for file in (ROOT / package).rglob("*.py"))
"""Every module of the service."""

MOST_LINES = 400
"""Number of lines that a file may have."""

MOST_FILES = 14
"""Number of modules that a folder may have."""

LARGER_FOLDERS = {
    "planner/certificate": "a module for each kind of check",
    "planner/tool_motions": "a module for each kind of path, and for each way in which the joints follow it",
}
"""Folders with more modules, and why."""

PRIVATE_WORDS = {
    "demand": "limit or need",
    "due": "expected or target",
    "owner": "segment, group or run",
    "place": "gridpoint, knot, position or point",
    "station": "gridpoint",
    "told": "distinguished",
}
"""Words that are not the field's, and the words for what they were used for."""

LOOSE_BEGINNINGS = {"At", "By", "From", "In", "Of", "On", "Than", "To", "Where", "With"}
"""Words that a docstring begins with which is no sentence but the rest of one."""


def by_name(file: Path) -> str:
    return str(file.relative_to(ROOT))


def folders() -> list[Path]:
    return sorted({file.parent for file in [*FILES, *SERVICE_FILES]})


def names_in(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Every name that a module defines or uses, with its line."""
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.keyword(arg=str(name)):
                yield name, node.lineno
            case ast.arg(arg=name) | ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                yield name, node.lineno


def private_words(name: str) -> set[str]:
    """The private words of an identifier, in the singular."""
    words = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)
    return {word.lower().removesuffix("s") for word in words} & set(PRIVATE_WORDS)


def constants(tree: ast.Module) -> Iterator[tuple[ast.Assign | ast.AnnAssign, list[ast.expr], str | None]]:
    """The assignments at the level of a module, their targets, and the docstring below each."""
    for node, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            match after:
                case ast.Expr(value=ast.Constant(value=str(docstring))):
                    yield node, targets, docstring
                case _:
                    yield node, targets, None


def faults_of_constants(source: str) -> list[str]:
    """What is wrong with the constants of a module: several on a line, or one without a sentence below it."""
    faults = []
    for node, targets, docstring in constants(ast.parse(source)):
        if len(targets) > 1 or isinstance(targets[0], ast.Tuple):
            faults.append(f"line {node.lineno}: several constants at once")
        elif isinstance(targets[0], ast.Name) and targets[0].id.isupper():
            if docstring is None:
                faults.append(f"line {node.lineno}: {targets[0].id} has no docstring")
            elif not is_sentence(docstring):
                faults.append(f"line {node.lineno}: the docstring of {targets[0].id} is a fragment")
    return faults


def is_sentence(docstring: str) -> bool:
    """Whether a docstring neither begins like the rest of a sentence, nor with a shape alone, and comes to an end."""
    first = re.match(r"\w+", docstring)
    loose = first is None or first[0] in LOOSE_BEGINNINGS
    summary = docstring.strip().split("\n\n")[0].rstrip()
    return not loose and summary.endswith((".", ":", "!", "?"))


@pytest.mark.parametrize("file", [*FILES, *SERVICE_FILES], ids=by_name)
def test_files_are_short(file: Path) -> None:
    assert len(file.read_text().splitlines()) <= MOST_LINES


@pytest.mark.parametrize("folder", folders(), ids=by_name)
def test_folders_are_small(folder: Path) -> None:
    modules = list(folder.glob("*.py"))
    assert (len(modules) > MOST_FILES) == (by_name(folder) in LARGER_FOLDERS), f"{len(modules)} modules"


def test_no_test_module_is_imported() -> None:
    """What several tests need is a helper with a file of its own."""
    imported = re.compile(r"^\s*(from|import) tests(\.\w+)*\.test_\w+", re.MULTILINE)
    assert imported.search("from tests.planner.test_style import FILES")
    files = sorted((ROOT / "tests").rglob("*.py"))
    assert not [file.name for file in files if imported.search(file.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("file", FILES, ids=by_name)
def test_names_are_words_of_the_field(file: Path) -> None:
    found = [(name, line) for name, line in names_in(ast.parse(file.read_text())) if private_words(name)]
    hints = [f"line {line}: {name} (say {PRIVATE_WORDS[word]})" for name, line in found for word in private_words(name)]
    assert not hints


@pytest.mark.parametrize("file", FILES, ids=by_name)
def test_a_constant_stands_on_a_line_of_its_own_with_what_it_means(file: Path) -> None:
    assert not faults_of_constants(file.read_text())


@pytest.mark.parametrize("file", FILES, ids=by_name)
def test_docstrings_are_no_fragments(file: Path) -> None:
    tree = ast.parse(file.read_text())
    documented = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module)]
    docstrings = {getattr(node, "name", "the module"): ast.get_docstring(node) for node in documented}
    assert not [name for name, docstring in docstrings.items() if docstring and not is_sentence(docstring)]


def test_the_checks_see_what_is_wrong() -> None:
    assert private_words("by_place") == {"place"}
    assert private_words("dueDates") == {"due"}
    assert private_words("OWNERS_OF") == {"owner"}
    assert not private_words("replaced_residue")
    assert {name for name, _ in names_in(ast.parse("def f(a, *, b=1):\n    c.d = g(e=2)"))} == set("abcdefg")
    assert faults_of_constants('A, B = 1, 2\n"""Both."""') == ["line 1: several constants at once"]
    assert faults_of_constants("A = 1\nB = 2") == ["line 1: A has no docstring", "line 2: B has no docstring"]
    assert faults_of_constants('A = 1\n"""Of the whole."""') == ["line 1: the docstring of A is a fragment"]
    assert not faults_of_constants('A = 1\n"""The number of pieces."""')
    assert not is_sentence("(N,), s.")
    assert not is_sentence("Where it is.")
    assert is_sentence("The times (N,), s.")
