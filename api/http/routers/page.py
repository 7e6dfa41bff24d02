"""The page that people look at, as it was built with the package (web/build_hook.py)."""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

import structlog
from fastapi import Request, Response

from api.base import content_policies as policies
from api.base.codings import GZIP, VARY
from api.base.errors import NotFound
from api.http.replies import coding_of
from api.http.router import Router

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

MEDIA_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
"""The media types of the page's files, by their suffixes; there are no others."""

HEADERS = {"X-Content-Type-Options": "nosniff", **VARY}
"""Headers of all files of the page."""

DOCUMENT_HEADERS = {
    "Content-Security-Policy": policies.PAGE,
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}
"""Headers of the document: the policy, and that browsers ask each time, as it names the files of its version."""

FOREVER = {"Cache-Control": "public, max-age=31536000, immutable"}
"""The header of the other files, whose names change with their content."""

NOT_BUILT = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>Trajectory planner</title>
<h1>Trajectory planner</h1>
<p>The service runs, but its page was not built when the package was installed. The service's log says why.</p>
<p><a href="docs">The documentation of its HTTP interface</a></p>
</html>
"""
"""The document where the page was not built."""

router = Router(include_in_schema=False)

log = structlog.get_logger()


@router.get("/")
async def page(request: Request) -> Response:
    """Answer GET /: the page, for everybody but those who ask for JSON and take no HTML."""
    accept = request.headers.get("accept", "*/*")
    if "json" in accept and "text/html" not in accept:
        raise NotFound("Nothing has this path. See /docs for the paths.")
    folder = built_page()
    if not folder.joinpath("index.html").is_file():
        return Response(NOT_BUILT, headers=HEADERS | DOCUMENT_HEADERS, media_type="text/html")
    return _file(request, folder, "index.html", DOCUMENT_HEADERS)


@router.get("/assets/{name}")
async def page_file(request: Request, name: str) -> Response:
    """Answer GET /assets/{name}."""
    if name not in _names():
        raise NotFound("No file has this path.")
    return _file(request, built_page() / "assets", name, FOREVER)


def warn_if_not_built() -> None:
    """Say in the log why there is no page, if there is none."""
    folder = built_page()
    if not folder.joinpath("index.html").is_file():
        said = folder.joinpath("not_built.txt")
        reason = said.read_text() if said.is_file() else "the package was not installed by pip"
        log.warning("page_not_built", reason=reason)


def built_page() -> Traversable:
    """Find the folder that the page was built into."""
    return files("api").joinpath("built_page")


def _names() -> frozenset[str]:
    """List the files beside the document, without their compressed copies; none where the page was not built."""
    assets = built_page() / "assets"
    files_there = assets.iterdir() if assets.is_dir() else ()
    return frozenset(file.name for file in files_there if _suffix(file.name) in MEDIA_TYPES)


def _suffix(name: str) -> str:
    return name[name.rfind(".") :]


def _file(request: Request, folder: Traversable, name: str, headers: dict[str, str]) -> Response:
    compressed = folder.joinpath(f"{name}.gz")
    headers = HEADERS | headers
    if coding_of(request, (GZIP,)).name and compressed.is_file():
        content, headers = compressed.read_bytes(), headers | {"Content-Encoding": GZIP}
    else:
        content = folder.joinpath(name).read_bytes()
    return Response(content, headers=headers, media_type=MEDIA_TYPES[_suffix(name)])
