"""MessagePack: the answer of the HTTP contract in fewer bytes, numbers exact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import ormsgpack

from planner.export.base import ExportOptions, Format
from planner.export.json import as_dict

if TYPE_CHECKING:
    from planner.plans.result import Plan


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as the map that the JSON form is."""
    return ormsgpack.packb(as_dict(plan, options), option=ormsgpack.OPT_SERIALIZE_NUMPY)


FORMAT = Format("msgpack", "application/vnd.msgpack", ".msgpack", render)
"""The form of MessagePack."""
