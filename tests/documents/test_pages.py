"""The pages of the documentation: correct output of examples, existing names, complete contents."""

from __future__ import annotations

import re

import pytest
import yaml

import planner
from tests.documents.pages import examples_of, run
from tests.locations import ROOT
from tests.planner.layers import LAYERS

DOCS = ROOT / "docs"
PAGES = ["README.md", *sorted(str(page.relative_to(ROOT)) for page in DOCS.rglob("*.md"))]
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d*)?")


def text_of(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


RUN = [page for page in PAGES if examples_of(text_of(page))]


def assert_printed(shown: str, printed: str) -> None:
    """Assert equal words, and numbers equal within 1 %, since solver results differ slightly between machines."""
    assert NUMBER.sub("#", printed).split() == NUMBER.sub("#", shown).split()
    numbers, expected = ([float(text) for text in NUMBER.findall(side)] for side in (printed, shown))
    assert numbers == pytest.approx(expected, rel=0.01, abs=1e-4)


def test_pages_with_examples_are_found() -> None:
    assert {"README.md", "docs/index.md", "docs/library.md"} <= set(RUN)


@pytest.mark.long_table
@pytest.mark.parametrize("page", RUN)
def test_examples_print_what_is_shown(page: str) -> None:
    examples = examples_of(text_of(page))
    assert text_of(page).count("```python\n") == len(examples)
    for example, printed in zip(examples, run(examples, page), strict=True):
        try:
            assert_printed(example.shown, printed)
        except AssertionError as difference:
            raise AssertionError(f"{page}, line {example.line}, prints\n{printed}") from difference


def test_the_comparison_of_outputs_sees_differences() -> None:
    assert_printed("0.7666 s\n[1.  2.5]\n", "0.7667 s\n[1.0 2.5]\n")
    for shown, printed in (
        ("0.76 s", "0.78 s"),
        ("a 1", "b 1"),
        ("1 2", "1"),
        ("", "1"),
        ("-1.0", "1.0"),
        ("True", ""),
    ):
        with pytest.raises(AssertionError):
            assert_printed(shown, printed)


def test_every_public_name_has_an_example_and_an_entry() -> None:
    code = "\n".join(example.code for page in RUN for example in examples_of(text_of(page)))
    used = {name: f"{code}\n{getattr(getattr(planner, name), '__doc__', None) or ''}" for name in planner.__all__}
    assert not [name for name, text in used.items() if not re.search(rf"\bplanner\.{name}\b", text)]
    entries = [
        entry for page in PAGES for entry in re.findall(r"^::: planner\.(?:\w+\.)*(\w+)$", text_of(page), re.MULTILINE)
    ]
    assert sorted(name for name in entries if name in planner.__all__) == sorted(planner.__all__)


@pytest.mark.parametrize("page", PAGES)
def test_files_and_folders_that_are_named_are_there(page: str) -> None:
    """Whatever is written as code and looks like a path of this repository."""
    named = re.findall(r"`((?:planner|api|cli|tests|docs|benchmarks|examples|\.ci)/[\w./]*)`", text_of(page))
    if page == "docs/architecture.md":
        assert len(named) > 50
    for path in named:
        assert (ROOT / path).is_dir() if path.endswith("/") else (ROOT / path).is_file(), f"{page} names {path}"


def test_the_architecture_names_every_folder() -> None:
    page = text_of("docs/architecture.md")
    folders = {
        f"{folder.relative_to(ROOT)}/"
        for package in ("planner", "api", "cli")
        for folder in (ROOT / package).rglob("*")
        if folder.is_dir()
        and not {"__pycache__", "built_page", "built"} & set(folder.parts)  # what is made from sources
    }
    assert len(folders) > 20
    assert not {folder for folder in folders if f"`{folder}`" not in page}


def test_the_architecture_has_the_order_of_the_layers() -> None:
    table = text_of("docs/architecture.md").partition("### The library")[2].partition("Among the back ends")[0]
    lines = [re.findall(r"`planner/(\w+)(?:/|\.py)`", line) for line in table.splitlines()]
    places = [place for layer in LAYERS for place, layers in enumerate(lines) if layer in layers]
    assert len(places) > 20
    assert places == sorted(places)


def test_the_navigation_has_every_page() -> None:
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("nav:\n")[2].partition("\nmarkdown")[0]
    listed = re.findall(r"[\w/]+\.md", str(yaml.safe_load(navigation)))
    assert sorted(listed) == sorted(str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md"))
