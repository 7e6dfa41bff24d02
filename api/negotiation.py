"""Which form of an answer the caller wants: `?format=`, or the `Accept` header (RFC 9110, Section 12.5.1)."""

from __future__ import annotations

from api.errors import NotAcceptable
from planner.export import FORMATS, Format


def negotiated(asked: str | None, accept: str) -> Format:
    """Choose the format to answer in.

    Args:
        asked: The name in the query, which goes before the header; None: there is none.
        accept: The `Accept` header.

    Raises:
        NotAcceptable: None of those asked for exists.
    """
    if asked is not None:
        if asked in FORMATS:
            return FORMATS[asked]
        raise _not_acceptable()
    names = list(FORMATS)
    best = max(names, key=lambda name: (_quality(FORMATS[name].media_type, accept), -names.index(name)))
    if _quality(FORMATS[best].media_type, accept) <= 0.0:
        raise _not_acceptable()
    return FORMATS[best]


def _not_acceptable() -> NotAcceptable:
    there_are = ", ".join(f"{name} ({form.media_type})" for name, form in FORMATS.items())
    return NotAcceptable(f"the formats are: {there_are}", formats=list(FORMATS))


def _quality(media_type: str, accept: str) -> float:
    """Weigh a media type in an `Accept` header: its weight is that of the most specific range that covers it."""
    kind = media_type.partition("/")[0]
    weights = {}
    for part in accept.split(","):
        media_range, *parameters = (piece.strip().lower() for piece in part.split(";"))
        weights[media_range] = next((_weight(p[2:]) for p in parameters if p.startswith("q=")), 1.0)
    for candidate in (media_type, f"{kind}/*", "*/*"):
        if candidate in weights:
            return weights[candidate]
    return 0.0


def _weight(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
