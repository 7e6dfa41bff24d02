"""The Content-Security-Policies of answers: a browser that shows one loads nothing from another host."""

from __future__ import annotations

REPORT = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""The policy of a report, which is one file with its program in it."""

PICTURE_OR_DATA = "default-src 'none'; style-src 'unsafe-inline'"
"""The policy of all other answers, pictures in SVG among them: they have no program."""

PAGE = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""The policy of the page: everything comes from the service, nothing is written into the page."""

DOCUMENTATION = (
    "default-src 'none'; script-src 'self' 'sha256-{digest}'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""The policy of Swagger UI, with the digest of the script that starts it."""


def default_policy(media_type: str) -> str:
    """Choose the policy of an answer whose route sets none."""
    return REPORT if media_type.partition(";")[0] == "text/html" else PICTURE_OR_DATA


def security_headers(media_type: str | None) -> dict[str, str]:
    """Return the headers that every answer has; None: it has no body, and keeps the policy of the one before."""
    headers = {"X-Content-Type-Options": "nosniff"}
    return headers if media_type is None else {**headers, "Content-Security-Policy": default_policy(media_type)}
