"""Rules of style: sizes of files and folders, names, constants, docstrings that are sentences, types of the library."""

from __future__ import annotations

import ast
import re
from collections import Counter, defaultdict
from typing import TYPE_CHECKING

from docs.tools.constants import accuracies, constants_of, document, is_number
from tests.lint.sources import python

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.lint.sources import Fault, Source, Sources

CODE = ("planner", "api", "cli")
"""Packages that are installed."""

MOST_LINES = 400
"""Number of lines that a file may have."""

LONGER_FILES = {
    "planner/proofs/checker.py": 600,  # one file that needs no other, so that it can be read and trusted alone
}
"""Files with another number of lines, and why."""

MOST_FILES = 14
"""Number of modules that a folder may have."""

LARGER_FOLDERS = {
    "api/contract": "a module for each subject of requests and answers",
    "api/work/tasks": "a module for each subject of operations",
    "planner/certificate": "a module for each kind of check",
    "planner/kernels": "a module for each subject of the compiled loops",
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
"""Words that are not the field's, and the words to use."""

LOOSE_BEGINNINGS = {"At", "By", "From", "In", "Of", "On", "Than", "To", "Where", "With"}
"""First words of docstrings that are fragments of a sentence."""


def long_files(sources: Sources) -> Iterator[Fault]:
    """Find files with too many lines."""
    for source in python(sources, *CODE):
        most = LONGER_FILES.get(source.file, MOST_LINES)
        if (lines := len(source.text.splitlines())) > most:
            yield source.fault(most + 1, f"has {lines} lines, {most} at most: split it by subject")


def large_folders(sources: Sources) -> Iterator[Fault]:
    """Find folders with too many modules and no reason, and reasons without need."""
    sizes = Counter(source.folder for source in python(sources, *CODE))
    for source in python(sources, *CODE):
        if source.file.endswith("/__init__.py") and ((size := sizes[source.folder]) > MOST_FILES) != (
            source.folder in LARGER_FOLDERS
        ):
            yield source.fault(1, f"has {size} modules, {MOST_FILES} at most or a reason in tests/lint/style.py")


def names_in(source: Source) -> Iterator[tuple[str, int]]:
    """Yield every name that a module defines or uses, with its line."""
    for node in source.nodes:
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.keyword(arg=str(name)):
                yield name, node.lineno
            case ast.arg(arg=name) | ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                yield name, node.lineno


def private_words(name: str) -> set[str]:
    """Find the private words of an identifier, in the singular."""
    words = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)
    return {word.lower().removesuffix("s") for word in words} & set(PRIVATE_WORDS)


def private_names(sources: Sources) -> Iterator[Fault]:
    """Find names of the library with words that are not the field's."""
    for source in python(sources, "planner"):
        for name, line in names_in(source):
            for word in private_words(name):
                yield source.fault(line, f"{name}: say {PRIVATE_WORDS[word]}")


def constants(sources: Sources) -> Iterator[Fault]:
    """Find constants of the library that share a statement or have no sentence below them."""
    for source in python(sources, "planner"):
        for node, targets, docstring in constants_of(source.tree):
            if len(targets) > 1 or isinstance(targets[0], ast.Tuple):
                yield source.fault(node.lineno, "several constants at once")
            elif isinstance(targets[0], ast.Name) and targets[0].id.isupper():
                if docstring is None:
                    yield source.fault(node.lineno, f"{targets[0].id} has no docstring")
                elif not is_sentence(docstring):
                    yield source.fault(node.lineno, f"the docstring of {targets[0].id} is a fragment")


def values_of_constants(sources: Sources) -> Iterator[Fault]:
    """Find names of numbers with several values in the library."""
    values: dict[str, dict[str, list[tuple[Source, int]]]] = defaultdict(lambda: defaultdict(list))
    for source in python(sources, "planner"):
        for node, targets, _ in constants_of(source.tree):
            if isinstance(targets[0], ast.Name) and targets[0].id.isupper() and is_number(node.value):
                values[targets[0].id][ast.unparse(node.value or node)].append((source, node.lineno))
    for name, places in values.items():
        if len(places) > 1:
            for source, line in (place for found in places.values() for place in found):
                yield source.fault(line, f"{name} has several values in planner/: {', '.join(places)}")


def is_sentence(docstring: str) -> bool:
    """Return whether a docstring begins like a sentence, not with a preposition or a shape, and ends like one."""
    first = re.match(r"\w+", docstring)
    loose = first is None or first[0] in LOOSE_BEGINNINGS
    summary = docstring.strip().split("\n\n")[0].rstrip()
    return not loose and summary.endswith((".", ":", "!", "?"))


def fragments(sources: Sources) -> Iterator[Fault]:
    """Find docstrings of the library that do not begin with a sentence."""
    for source in python(sources, "planner"):
        for node in source.nodes:
            if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module):
                docstring = ast.get_docstring(node)
                if docstring and not is_sentence(docstring):
                    yield source.fault(node.body[0].lineno, f"the docstring is a fragment: {docstring[:40]!r}")


def request_values(sources: Sources) -> Iterator[Fault]:
    """Find JSON pointers into requests, and objects of requests outside models of robots."""
    for source in python(sources, "planner"):
        for node in source.nodes:
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                if re.match(r"/[a-z_]+(/|$)", node.value):
                    yield source.fault(node.lineno, f"{node.value!r} is a pointer into a request")
            elif isinstance(node, ast.Dict) and "robots" not in source.file.split("/"):
                keys = {key.value for key in node.keys if isinstance(key, ast.Constant)}
                if "kind" in keys:
                    yield source.fault(node.lineno, "an object of a request")


def accuracy_page(sources: Sources) -> Iterator[Fault]:
    """Check whether docs/constants.md lists the current accuracy constants of the library."""
    expected = document(accuracies((source.file, source.tree) for source in python(sources, "planner"))).splitlines()
    for source in sources:
        if source.file == "docs/constants.md" and (written := source.text.splitlines()) != expected:
            differ = (k for k, pair in enumerate(zip(written, expected, strict=False), 1) if pair[0] != pair[1])
            line = next(differ, min(len(written), len(expected)))
            yield source.fault(line, "is not current: run python -m docs.tools.constants > docs/constants.md")
