"""Acceleration and jerk limits that fall with the payload."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from api.contract.parts.common import LARGEST, Schema

Factors = Annotated[list[Annotated[float, Field(gt=0.0, le=1.0)]], Field(min_length=2, max_length=64)]
"""Factors without unit."""


class PayloadTable(Schema):
    """Factors on acceleration and jerk limits by the payload mass, as controllers of makers have them.

    They are linear between the masses and constant beyond the first and last one.
    """

    masses: Annotated[list[Annotated[float, Field(ge=0.0, le=LARGEST)]], Field(min_length=2, max_length=64)]
    """The payload masses, ascending, kg."""
    acceleration: Factors
    """The factors on all acceleration limits at these masses, without unit. They must not grow with the mass."""
    jerk: Factors | None = None
    """The factors on all jerk limits, without unit; omitted: 1 at all masses."""
