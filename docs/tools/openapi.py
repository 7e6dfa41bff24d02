"""Puts the OpenAPI document on the documentation site, shown by Swagger UI and as a file.

A hook of MkDocs. The document stands in the page itself, so that the page works from the file system, too.
"""

from __future__ import annotations

import json
from importlib.resources import files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

FOLDER = "http_api"
"""The folder of the generated files on the site."""

SWAGGER_FILES = ("swagger-ui-bundle.js", "swagger-ui.css", "favicon-32x32.png")
"""Files of Swagger UI in the package `fastapi-swagger`, which the service also shows."""

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>HTTP interface</title>
<link rel="stylesheet" href="swagger-ui.css">
<link rel="icon" href="favicon-32x32.png">
<style>body {{ margin: 0; background: white }} .scheme-container, .info a.link {{ display: none }}</style>
</head>
<body>
<div id="swagger-ui"></div>
<script src="swagger-ui-bundle.js"></script>
<script>
const text = JSON.stringify({document})
const answer = async () => new Response(text, {{headers: {{"Content-Type": "application/json"}}}})
SwaggerUIBundle({{
  url: "http://planner.invalid/openapi.json", // a base for references; nothing is fetched
  requestInterceptor: (request) => Object.assign(request, {{userFetch: answer}}),
  dom_id: "#swagger-ui",
  deepLinking: true,
  defaultModelsExpandDepth: 0,
  supportedSubmitMethods: [],
  validatorUrl: null,
}})
</script>
</body>
</html>
"""
"""The page around the document. Nothing can be sent from it: there is no service behind a documentation site."""


def site_files() -> dict[str, str | bytes]:
    """Return the OpenAPI document, its page and the files of Swagger UI by their names."""
    from clients.document import document

    written = document()
    inline = json.dumps(json.loads(written)).replace("</", "<\\/")  # no text ends the script
    return {
        "openapi.json": written,
        "index.html": PAGE.format(document=inline),
        **{name: files("fastapi_swagger").joinpath("resources", name).read_bytes() for name in SWAGGER_FILES},
    }


def on_files(found: Files, config: MkDocsConfig) -> Files:
    """Add `site_files` to the site."""
    from mkdocs.structure.files import File

    for name, content in site_files().items():
        found.append(File.generated(config, f"{FOLDER}/{name}", content=content))
    return found
