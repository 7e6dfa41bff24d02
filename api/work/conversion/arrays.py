"""Rows of requests as arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import InvalidProblem

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner import FieldPath
    from planner.spatial import FloatArray


def to_matrix(rows: Sequence[Sequence[float]], columns: int, field: FieldPath) -> FloatArray:
    """Make rows (N, columns) an array.

    Raises:
        InvalidProblem: Naming each row that has another length.
    """
    wrong = [i for i, row in enumerate(rows) if len(row) != columns]
    if wrong:
        raise InvalidProblem(
            [((*field, i), f"must have one value for each of the {columns} joints; got {len(rows[i])}") for i in wrong]
        )
    return np.array(rows, dtype=np.float64)
