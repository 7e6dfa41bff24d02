"""The formats in which a plan can be answered: the answer as JSON or MessagePack, and the library's formats."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import orjson
import ormsgpack

from api.work.answers.plans import as_dict
from planner import export

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.work.answers.plans import AnswerOptions
    from planner.plans.result import Plan


@dataclass(frozen=True)
class Format:
    """A format of an answer for a plan: the fields of `planner.Format`, rendered with the options of an answer."""

    name: str
    media_type: str
    suffix: str
    render: Callable[[Plan, AnswerOptions], bytes]


def to_json(plan: Plan, options: AnswerOptions) -> bytes:
    """Write the answer as JSON; each number in the shortest form that reads back exactly."""
    return orjson.dumps(as_dict(plan, options), option=orjson.OPT_SERIALIZE_NUMPY)


def to_msgpack(plan: Plan, options: AnswerOptions) -> bytes:
    """Write the answer as MessagePack, with the same numbers in fewer bytes."""
    return ormsgpack.packb(as_dict(plan, options), option=ormsgpack.OPT_SERIALIZE_NUMPY)


_FIRST = ("json", "csv", "ros2", "msgpack")
_FORMATS = {
    "json": Format("json", "application/json", ".json", to_json),
    "msgpack": Format("msgpack", "application/vnd.msgpack", ".msgpack", to_msgpack),
} | {name: Format(**vars(form)) for name, form in export.FORMATS.items()}

FORMATS = {name: _FORMATS[name] for name in dict.fromkeys((*_FIRST, *_FORMATS))}
"""Every format by its name, in the order in which clients see them; the first is the default."""
