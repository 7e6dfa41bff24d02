"""Makes docs/settings.md from the settings of the service."""

from __future__ import annotations

from typing import Any

from api.base.settings import Settings

HEADER = """\
# Settings

Made by `python -m benchmarks.pages.settings > docs/settings.md` from `api/base/settings.py`; the tests make it again.

Every setting is an environment variable. [Deployment](deployment.md) says what they are for.

| variable | default | what it is |
|---|---|---|
"""
MADE = {"workers": "the processors that the process may use"}
"""Defaults that are computed, in words."""


def document() -> str:
    return HEADER + "".join(f"{_row(name, field)}\n" for name, field in Settings.model_fields.items())


def _row(name: str, field: Any) -> str:
    default = MADE.get(name, "-" if field.default in (None, ()) else f"`{field.default}`")
    meaning = " ".join((field.description or "").split()).replace("|", "\\|")
    return f"| `PLANNER_{name.upper()}` | {default} | {meaning} |"


if __name__ == "__main__":
    print(document(), end="")
