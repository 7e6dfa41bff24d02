"""Files that rules read, and the faults that they find."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cached_property
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


FOLDERS = ("planner", "api", "cli", "tests", "benchmarks", "clients", "deploy", "docs", "examples", "web")
MADE = {"node_modules", "__pycache__", "built", "built_page"}
"""Folders of the repository, and names of folders inside that hold no sources."""


@dataclass(frozen=True)
class Fault:
    """A place that breaks a rule."""

    file: str
    line: int
    text: str


@dataclass(frozen=True)
class Source:
    """A file of the repository, named from its root."""

    file: str
    text: str

    @cached_property
    def tree(self) -> ast.Module:
        """The syntax tree of a Python file."""
        return ast.parse(self.text)

    @cached_property
    def nodes(self) -> list[ast.AST]:
        """All nodes of the tree."""
        return list(ast.walk(self.tree))

    @property
    def package(self) -> str:
        """The folder or file at the root."""
        return PurePosixPath(self.file).parts[0]

    @property
    def folder(self) -> str:
        """The folder that the file stands in."""
        return str(PurePosixPath(self.file).parent)

    @property
    def module(self) -> str:
        """The name under which Python imports the file."""
        return self.file.removesuffix(".py").replace("/", ".").removesuffix(".__init__")

    def fault(self, line: int, text: str) -> Fault:
        """Make a fault of this file."""
        return Fault(self.file, line, text)


Sources = list[Source]


def python(sources: Iterable[Source], *packages: str) -> Iterator[Source]:
    """Yield the Python files of some packages, or of all."""
    for source in sources:
        if source.file.endswith(".py") and (not packages or source.package in packages):
            yield source


def read_sources() -> Sources:
    """Read every Python file and every page of the repository."""
    files = [
        file for name in FOLDERS for file in sorted((ROOT / name).rglob("*")) if file.suffix in {".py", ".pyi", ".md"}
    ]
    files = [file for file in [*ROOT.glob("*.md"), *files] if not MADE & set(file.parts)]
    return [Source(str(file.relative_to(ROOT)), file.read_text(encoding="utf-8")) for file in files]
