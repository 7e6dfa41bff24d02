"""Answers as the pages show them, compared with real ones."""

from __future__ import annotations

import json
from decimal import Decimal
from typing import Any

import pytest

ELLIPSIS = "..."


def parse_shown(text: str) -> Any:
    """Read JSON and keep the written digits of its numbers."""
    return json.loads(text, parse_float=Decimal)


def assert_shown(shown: Any, real: Any) -> None:
    """Assert that the real answer has everything shown; `...` stands for omitted content, numbers are rounded."""
    match shown:
        case dict():
            assert isinstance(real, dict)
            for key, value in shown.items():
                if key == ELLIPSIS:
                    continue
                assert key in real
                assert_shown(value, real[key])
        case list() if ELLIPSIS in shown:
            assert isinstance(real, list)
            gap = shown.index(ELLIPSIS)
            before, after = shown[:gap], shown[gap + 1 :]
            if ELLIPSIS in after:  # something in the middle
                assert not before
                (middle,) = after[:-1]
                assert any(_is_shown(middle, item) for item in real)
                return
            assert_shown(before, real[: len(before)])
            assert_shown(after, real[len(real) - len(after) :])
        case list():
            assert isinstance(real, list)
            assert len(shown) == len(real)
            for one, other in zip(shown, real, strict=True):
                assert_shown(one, other)
        case Decimal():
            digits = -int(shown.as_tuple().exponent)
            tolerance = 0.51 * 10.0**-digits if shown else 1e-6
            assert real == pytest.approx(float(shown), abs=tolerance, rel=0.0)
        case str() if shown.endswith(ELLIPSIS):
            assert real.startswith(shown.removesuffix(ELLIPSIS))
        case _:
            assert type(shown) is type(real)
            assert shown == real


def _is_shown(shown: Any, real: Any) -> bool:
    try:
        assert_shown(shown, real)
    except AssertionError:
        return False
    return True
