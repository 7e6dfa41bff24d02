"""Acceleration and jerk limits that fall with the payload."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from api.contract.parts.common import LARGEST, Schema

Factors = Annotated[list[Annotated[float, Field(gt=0.0, le=1.0)]], Field(min_length=2, max_length=64)]
"""Factors without unit."""


FactorsBySpeed = Annotated[list[Factors], Field(min_length=2, max_length=64)]
"""A row of factors for each mass, with a factor for each speed."""


class PayloadTable(Schema):
    """Factors on acceleration and jerk limits by payload mass and speed, as controllers of makers have them.

    They are linear between the masses, and between the speeds, and constant beyond the first and last one.
    """

    masses: Annotated[list[Annotated[float, Field(ge=0.0, le=LARGEST)]], Field(min_length=2, max_length=64)]
    """The payload masses, ascending, kg."""
    acceleration: Factors
    """The factors on all acceleration limits at these masses, without unit. They must not grow with the mass."""
    jerk: Factors | None = None
    """The factors on all jerk limits, without unit; omitted: 1 at all masses."""
    speeds: Annotated[list[Annotated[float, Field(ge=0.0, le=1.0)]], Field(min_length=2, max_length=64)] | None = Field(
        None, exclude_if=lambda speeds: speeds is None
    )
    """The speeds of a joint for factors by speed, ascending, as shares of its velocity limit; omitted: none."""
    acceleration_at_speeds: FactorsBySpeed | None = Field(None, exclude_if=lambda rows: rows is None)
    """Further factors on the acceleration limit of each joint, without unit: a row for each mass, with a factor for
    each of the `speeds`. They must not grow with the mass or the speed. Omitted: 1."""
    jerk_at_speeds: FactorsBySpeed | None = Field(None, exclude_if=lambda rows: rows is None)
    """Further factors on the jerk limit of each joint, without unit, in the same rows. Omitted: 1."""
