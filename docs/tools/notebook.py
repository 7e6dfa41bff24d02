"""Runs docs/notebook.ipynb while the documentation is built: its cells and their output become docs/notebook.md.

A hook of MkDocs. A cell that fails, fails the build.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.structure.pages import Page

NOTEBOOK = Path(__file__).parents[2] / "docs/notebook.ipynb"
PAGE = "notebook.md"

SECONDS = 120
"""The longest that a cell may take, s."""

FORMS = ("text/html", "image/svg+xml", "text/plain")
"""The forms of a result that are shown, the best first."""


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Put the notebook, run afresh, below the text of its page."""
    if page.file.src_uri != PAGE:
        return markdown
    return f"{markdown}\n\n{as_markdown(executed()['cells'])}"


def executed() -> dict[str, Any]:
    """Run the notebook in a kernel of its own.

    Raises:
        CellExecutionError: A cell failed.
    """
    import nbformat
    from jupyter_client.manager import AsyncKernelManager
    from nbclient import NotebookClient

    notebook: Any = nbformat.reads(NOTEBOOK.read_text(encoding="utf-8"), as_version=4)
    kernel = AsyncKernelManager(transport="ipc")  # sockets of this machine's file system, not its network
    NotebookClient(notebook, km=kernel, timeout=SECONDS).execute()
    done: dict[str, Any] = notebook
    return done


def as_markdown(cells: list[dict[str, Any]]) -> str:
    """Write cells and their results as Markdown, in which HTML stands as it is."""
    parts = []
    for cell in cells:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        parts += [_shown(output) for output in cell["outputs"]]
    return "\n\n".join(parts)


def _shown(output: dict[str, Any]) -> str:
    if output["output_type"] == "stream":
        return f"```text\n{''.join(output['text']).rstrip()}\n```"
    form = next(form for form in FORMS if form in output["data"])
    content = "".join(output["data"][form])
    if form == "text/plain":
        return f"```text\n{content}\n```"
    # A blank line would end the HTML for Markdown.
    return "<div>" + "\n".join(line for line in content.splitlines() if line.strip()) + "</div>"
