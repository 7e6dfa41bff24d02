"""docs/notebook.ipynb: its cells run, displayed objects have a form for notebooks, and results become Markdown."""

from __future__ import annotations

import ast
import json
from typing import Any

import pytest

from docs.tools.notebook import FORMS, NOTEBOOK, as_markdown
from planner.plans.result import Plan
from planner.plots.animation import Animation
from planner.plots.picture import Picture

CELLS: list[dict[str, Any]] = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]


def shown_by(source: str, names: dict[str, Any]) -> Any:
    """Run a cell as a notebook does; what its last expression is."""
    *body, last = ast.parse(source).body
    exec(compile(ast.Module(body, []), "cell", "exec"), names)  # noqa: S102 - our own page
    if not isinstance(last, ast.Expr):
        exec(compile(ast.Module([last], []), "cell", "exec"), names)  # noqa: S102
        return None
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)  # noqa: S307


def test_the_cells_run_and_show_plans_pictures_and_motion(capsys: pytest.CaptureFixture[str]) -> None:
    assert not any(cell.get("outputs") for cell in CELLS), "results are made when the pages are built"
    names: dict[str, Any] = {}
    shown = [shown_by("".join(cell["source"]), names) for cell in CELLS if cell["cell_type"] == "code"]
    assert [type(value) for value in shown if value is not None] == [Plan, Picture, Picture, Animation]
    assert "nan" not in capsys.readouterr().out


def test_results_become_markdown() -> None:
    html = ["<b>a</b>\n", "\n", "<i/>"]
    outputs = [
        {"output_type": "stream", "text": ["1\n", "2\n"]},
        {
            "output_type": "execute_result",
            "data": {"text/plain": ["<Plan>"], "text/html": html},
        },
        {"output_type": "execute_result", "data": {"text/plain": ["3.0"]}},
    ]
    cells = [
        {"cell_type": "markdown", "source": ["# Title"]},
        {"cell_type": "code", "source": ["f()\n", "g()"], "outputs": outputs},
    ]
    assert as_markdown(cells).split("\n\n") == [
        "# Title",
        "```python\nf()\ng()\n```",
        "```text\n1\n2\n```",
        "<div><b>a</b>\n<i/></div>",
        "```text\n3.0\n```",
    ]
    assert FORMS[-1] == "text/plain"
