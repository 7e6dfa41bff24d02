"""One browser and one service for all tests of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from tests.api.conftest import RunningService, running_service, start_service
from web.tests.browser import PATIENCE, launched, opened, planned

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["start_service"]

expect.set_options(timeout=PATIENCE)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        yield launched(playwright)


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    with running_service(tmp_path_factory.mktemp("service") / "log.jsonl") as running:
        yield running


@pytest.fixture
def page(browser: Browser, service: RunningService) -> Iterator[Page]:
    """The page with its first example, planned."""
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        yield page
