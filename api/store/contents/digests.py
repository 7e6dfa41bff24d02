"""The digests by which answers quote requests and robots."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import BaseModel


def sha256(content: bytes) -> str:
    """Make the SHA-256 of a content as answers show it, `sha256:` and 64 hexadecimal digits."""
    return "sha256:" + hashlib.sha256(content).hexdigest()


def canonical(request: BaseModel, exclude: set[str] | None = None) -> bytes:
    """Write the request with all defaults and its keys in the schema's order: notation makes no difference."""
    return request.model_dump_json(exclude=exclude, by_alias=True).encode()


def request_hash(request: BaseModel, robot: bytes | None = None, roadmap: bytes | None = None) -> str:
    """Make what an answer quotes its request by: two requests with the same hash ask for the same plan.

    Args:
        request: The request, which names its robot by an id. The catalogue belongs to the version of the service.
        robot: The definition of an uploaded robot, whose id may belong to another one later; None: a catalogue robot.
        roadmap: The bytes of the roadmap on which free motions are searched; None: there is none.
    """
    content = canonical(request, exclude={"picture"})  # the plan is the same, however it is drawn
    return sha256(b"\n".join([content, *(part for part in (robot, roadmap) if part is not None)]))
