"""Makes docs/settings.md from the settings of the service."""

from __future__ import annotations

from typing import Any

from api.base.settings import Settings

HEADER = """\
# Settings

Generated from `api/base/settings.py` by `python -m docs.tools.settings > docs/settings.md`.

Every setting is an environment variable. [Deployment](deployment.md) explains when to change them.

| variable | default | meaning |
|---|---|---|
"""
COMPUTED = {"workers": "the processors available to the process"}
"""Computed defaults, in words."""


def document() -> str:
    return HEADER + "".join(f"{_row(name, field)}\n" for name, field in Settings.model_fields.items())


def _row(name: str, field: Any) -> str:
    default = COMPUTED.get(name, "-" if field.default in (None, ()) else f"`{field.default}`")
    meaning = " ".join((field.description or "").split()).replace("|", "\\|")
    return f"| `PLANNER_{name.upper()}` | {default} | {meaning} |"


if __name__ == "__main__":
    print(document(), end="")
