"""docs/settings.md equals the output of its script and describes every setting."""

from __future__ import annotations

import pytest

from api.base.settings import Settings
from docs.tools.settings import document
from tests.locations import ROOT


def test_the_page_is_what_the_script_makes() -> None:
    assert (ROOT / "docs/settings.md").read_text(encoding="utf-8") == document()


@pytest.mark.parametrize("name", Settings.model_fields)
def test_every_setting_is_explained(name: str) -> None:
    description = Settings.model_fields[name].description
    assert description and description.endswith(".") and len(description.split()) > 3
