"""docs/problems.md equals the output of its script and explains every problem code."""

from __future__ import annotations

import re

import pytest

from api.base.errors import STATUS_OF_CODE
from api.base.settings import Settings
from docs.tools.problems import ADVICE, Advice, document, titles_of_codes
from tests.locations import ROOT

CODES = [(code, advice) for subject in ADVICE.values() for code, advice in subject.items()]


def test_the_page_is_what_the_script_makes() -> None:
    assert (ROOT / "docs/problems.md").read_text(encoding="utf-8") == document()


def test_every_code_is_explained_once() -> None:
    assert sorted(code for code, _ in CODES) == sorted(STATUS_OF_CODE)
    assert set(titles_of_codes()) >= set(STATUS_OF_CODE)


@pytest.mark.parametrize(("code", "advice"), CODES)
def test_cause_and_remedy_are_sentences_about_existing_settings(code: str, advice: Advice) -> None:
    for sentence in advice:
        assert sentence.endswith(".") and len(sentence.split()) > 3, code
    known = {f"PLANNER_{name.upper()}" for name in Settings.model_fields}
    assert set(re.findall(r"PLANNER_[A-Z_]+", " ".join(advice))) <= known
