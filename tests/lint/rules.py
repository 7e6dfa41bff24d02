"""All rules by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.lint import imports, style, words

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.lint.sources import Fault, Sources

RULES: dict[str, Callable[[Sources], Iterator[Fault]]] = {
    "circle": imports.circles,
    "forbidden-import": imports.forbidden_imports,
    "imported-test": imports.imported_tests,
    "inner-name": imports.inner_names,
    "layer": imports.layers,
    "missing-name": imports.missing_names,
    "relative-import": imports.relative_imports,
    "stranger": imports.strangers,
    "accuracy-page": style.accuracy_page,
    "constant": style.constants,
    "constant-value": style.values_of_constants,
    "fragment": style.fragments,
    "large-folder": style.large_folders,
    "long-file": style.long_files,
    "private-name": style.private_names,
    "request-value": style.request_values,
    "clause": words.clauses,
    "long-sentence": words.long_sentences,
    "long-summary": words.long_summaries,
    "term": words.terms,
    "verb": words.verbs,
}
