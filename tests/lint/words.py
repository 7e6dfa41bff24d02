"""Rules for English: short sentences, terms of the glossary, nouns instead of clauses, verbs in front."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import TYPE_CHECKING

from tests.lint.sources import python

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.lint.sources import Fault, Source, Sources

MOST_WORDS_OF_A_SUMMARY = 20
MOST_WORDS_OF_A_SENTENCE = 25
VERBS = frozenset((Path(__file__).parent / "verbs.txt").read_text(encoding="utf-8").split())
"""Verbs that docstrings of functions begin with, in alphabetical order."""

REPEATS = {"docs/constants.md"}
"""Pages made of docstrings, which are checked where they stand."""

TERMS = {
    r"postures?": "joint position",
    r"told": "given",
    r"asked": "requested",
    r"(?:hold|holds|held|holding) (?:\w+ ){0,3}against": "check against",
    r"ways? around": "detour",
    r"what stands around": "scene",
    r"stations?": "gridpoint",
    r"(?<!control )laws?(?! of (?:co)?sines)": "time scaling",
    r"(?<!degrees of )(?<!degree of )freedoms?": "tolerance region",
    r"done with": "finished",
    r"(?:is|are) yet to": "the plain future, or `not yet`",
    r"from which on": "above which",
    r"all but": "almost, or except",
}
"""Words that the glossary forbids, and the words to use."""

CLAUSES = [
    r"what (?:is|are|was|were|has|have|had|does|do|goes|stands|comes|lies|moves|they|it|the|a|one)",
    r"how (?:long|far|much|often)",
    r"those (?:of|that|which|with|without|in|at|from|for)",
    r"none that",
]
"""Beginnings of clauses that stand where a noun should."""

ABBREVIATION = re.compile(r"\b(e\.g|i\.e|etc|cf|vs|approx|Fig|Eq|No|p|pp|Sec|Ch|Dr|et al)\.")
SENTENCE = re.compile(r"\S.*?(?:[.!?](?=[\s\"')*]|$)|:(?=\n|$)|\Z)", re.DOTALL)
BEGINS_ANEW = re.compile(
    r"\s*(?:[-*] |\d+\. |[\w*`]+(?: \([^)]*\))?: |(?:Args|Returns|Raises|Yields|Attributes|Example)s?:$)"
)
TERM = re.compile(rf"\b(?:{'|'.join(TERMS)})\b", re.IGNORECASE)
CLAUSE = re.compile(rf"\b(?:{'|'.join(CLAUSES)})\b[^.?!]*(?P<end>[?])?", re.IGNORECASE)

Text = tuple[int, str]
"""The first line of a text, and the text."""


def docstrings(source: Source) -> Iterator[Text]:
    """Yield every string that stands alone as a statement."""
    for node in source.nodes:
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                yield node.lineno, text


def paragraphs(text: Text, *, page: bool) -> Iterator[Text]:
    """Yield paragraphs, items of lists and cells of tables, without code."""
    first, content = text
    found: list[tuple[int, list[str]]] = []
    fence, example, open_ = False, False, False
    for number, line in enumerate(content.splitlines(), first):
        bare = line.strip()
        if page and bare.startswith(("```", "~~~")):
            fence, open_ = not fence, False
        elif fence:
            continue
        elif not bare or (page and bare.startswith(("#", "<", "!", ":::", "$"))):
            example, open_ = False, False
        elif example or bare.startswith((">>>", "...")):
            example, open_ = True, False
        elif bare.startswith("|"):
            open_ = False
            found += [(number, [cell]) for cell in bare.strip("|").split("|") if re.search(r"\w", cell)]
        elif open_ and not BEGINS_ANEW.match(line):
            found[-1][1].append(line)
        else:
            found.append((number, [line]))
            open_ = True
    for number, lines in found:
        yield number, "\n".join(lines)


def plain(text: str) -> str:
    """Replace code, links and abbreviations by a word each."""
    text = re.sub(r"(`+)[^`]+\1", lambda code: "code" + "\n" * code[0].count("\n"), text)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    return ABBREVIATION.sub(r"\1", text)


def sentences(text: Text, *, page: bool) -> Iterator[Text]:
    """Yield the sentences of a text."""
    for line, paragraph in paragraphs(text, page=page):
        words = plain(paragraph)
        for found in SENTENCE.finditer(words):
            yield line + words[: found.start()].count("\n"), found[0]


def prose(sources: Sources) -> Iterator[tuple[Source, int, str]]:
    """Yield every sentence of docstrings and pages."""
    for source in sources:
        if source.file in REPEATS:
            continue
        page = source.file.endswith(".md")
        for text in [(1, source.text)] if page else docstrings(source):
            for line, sentence in sentences(text, page=page):
                yield source, line, sentence


def count_words(text: str) -> int:
    """Count the words of a text; numbers are words, signs are not."""
    return len([word for word in text.split() if re.search(r"\w", word)])


def beginning(sentence: str) -> str:
    """Return the first words of a sentence, for a message."""
    return " ".join(sentence.split()[:6])


def long_sentences(sources: Sources) -> Iterator[Fault]:
    """Find long sentences of docstrings and pages."""
    limit = MOST_WORDS_OF_A_SENTENCE
    for source, line, sentence in prose(sources):
        if (words := count_words(sentence)) > limit:
            yield source.fault(line, f"a sentence of {words} words, {limit} at most: {beginning(sentence)} ...")


def terms(sources: Sources) -> Iterator[Fault]:
    """Find words in docstrings and pages for which docs/glossary.md has others."""
    for source, line, sentence in prose(sources):
        for found in TERM.finditer(sentence) if source.file != "docs/glossary.md" else ():
            hint = next(use for term, use in TERMS.items() if re.search(rf"\b{term}\b", found[0], re.IGNORECASE))
            at = line + sentence[: found.start()].count("\n")
            yield source.fault(at, f"{found[0]!r}: say {hint}")


def clauses(sources: Sources) -> Iterator[Fault]:
    """Find clauses with `what`, `how long` or `those of` that stand where a noun should."""
    for source, line, sentence in prose(sources):
        for found in CLAUSE.finditer(sentence):
            if not found["end"]:
                at = line + sentence[: found.start()].count("\n")
                yield source.fault(at, f"name the noun instead of {beginning(found[0])!r}")


def described(source: Source) -> Iterator[tuple[ast.FunctionDef | ast.AsyncFunctionDef, str]]:
    """Yield functions with their docstrings, without tests, fixtures and properties, which are no actions."""
    for node in source.nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not node.name.startswith("test_"):
            decorators = " ".join(map(ast.unparse, node.decorator_list))
            docstring = ast.get_docstring(node)
            if docstring and not re.search(r"property|fixture|\.setter", decorators):
                yield node, docstring


def long_summaries(sources: Sources) -> Iterator[Fault]:
    """Find docstrings of functions with a long first line."""
    limit = MOST_WORDS_OF_A_SUMMARY
    for source in python(sources):
        for node, docstring in described(source):
            if (words := count_words(plain(docstring.splitlines()[0]))) > limit:
                yield source.fault(node.body[0].lineno, f"{node.name}: a first line of {words} words, {limit} at most")


def verbs(sources: Sources) -> Iterator[Fault]:
    """Find docstrings of functions that do not begin with a verb."""
    for source in python(sources):
        for node, docstring in described(source):
            word = re.match(r"\W*(\w*)", docstring)
            if word is None or word[1].lower() not in VERBS:
                text = f"the docstring of {node.name} begins with {docstring.split()[0]!r}: begin with a verb"
                yield source.fault(node.body[0].lineno, f"{text} (tests/lint/verbs.txt)")
