"""The page in English and German: the browser decides, until a person chooses."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from playwright.sync_api import expect

from tests.locations import ROOT
from web.tests.browser import opened, planned
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.api.conftest import RunningService

SHOWN = """() => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const texts = [...document.querySelectorAll('[aria-label], [title]')].flatMap((part) => [part.ariaLabel, part.title]);
  while (walker.nextNode()) texts.push(walker.currentNode.textContent);
  return texts.filter((text) => text).map((text) => text.trim());
}"""
"""Collects the texts and labels that the page shows."""


def texts_of(language: str) -> set[str]:
    """Return the plain texts of a language, as its files have them."""
    files = (ROOT / "web/src/texts" / language).glob("*.ts")
    return {text for file in files for text in re.findall(r": '((?:[^'\\]|\\.)+)'", file.read_text())}


def shown(page: Page) -> set[str]:
    found: set[str] = set()
    for tab in page.get_by_role("tab").all():
        tab.click()
        found |= set(page.evaluate(SHOWN))
    return found


def test_a_german_browser_shows_german_and_a_person_may_change_that(browser: Browser, service: RunningService) -> None:
    english, german = texts_of("en"), texts_of("de")
    only_english, only_german = english - german - {"English"}, german - english - {"Deutsch"}
    with opened(browser, f"{service.url}/", locale="de-DE") as page:
        assert "Zertifiziert" in planned(page)
        assert page.evaluate("document.documentElement.lang") == "de"
        texts = shown(page)
        assert len(texts & only_german) > 50
        assert texts & only_english == set()
        assert violations(page) == []
        page.get_by_role("button", name="English").click()
        expect(page.locator(".verdict")).to_contain_text("Certified")
        assert page.evaluate("document.documentElement.lang") == "en"
        texts = shown(page)
        assert len(texts & only_english) > 50
        assert texts & only_german == set()
        page.reload()
        expect(page.get_by_role("button", name="Deutsch")).to_be_visible()
