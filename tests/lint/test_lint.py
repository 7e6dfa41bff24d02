"""Every rule of `python -m tests.lint` finds a made-up fault, and the baseline lets no count rise."""

from __future__ import annotations

import pytest

from docs.tools.constants import Constant, document
from tests.lint.baseline import compare, lowered
from tests.lint.rules import RULES
from tests.lint.sources import Source

LONG = " ".join(["word"] * 26) + "."
A_VERB = 'def f():\n    """Return it."""\n'
PAGE = document([Constant("A", 1e-9, "Length, m.", "planner/a.py")])
CASES = {
    "circle": (
        {"api/a.py": "import api.b", "api/b.py": "from api import a", "api/c.py": ""},
        {"api/a.py:1", "api/b.py:1"},
    ),
    "forbidden-import": (
        {
            "planner/plots/a.py": "import matplotlib",
            "planner/b.py": "x = 1\nimport matplotlib",
            "api/c.py": "import casadi.tools",
            "tests/planner/d.py": "import numpy\nfrom api.work import entry",
            "tests/api/e.py": "from api.work import entry",
        },
        {"planner/b.py:2", "api/c.py:1", "tests/planner/d.py:2"},
    ),
    "imported-test": (
        {"tests/a.py": "\nfrom tests import test_b", "tests/test_b.py": "from tests.a import test_c"},
        {"tests/a.py:2"},
    ),
    "inner-name": (
        {
            "planner/__init__.pyi": "from planner.plans.result import Plan as Plan",
            "planner/shapes/__init__.py": '__all__ = ["Box"]',
            "api/a.py": "from planner import shapes\nfrom planner.plans.result import Plan, timed",
            "cli/b.py": "from planner.shapes.primitives import Box\nif True:\n    from planner.shapes.shape import f",
        },
        {"api/a.py:2", "cli/b.py:3"},
    ),
    "layer": (
        {
            "planner/kinematics/a.py": "import planner.limits",
            "planner/backends/ruckig/a.py": "from planner.backends.toppra import b",
            "planner/backends/toppra/b.py": "import planner.backends.trapezoidal.c",
            "planner/backends/trapezoidal/c.py": "",
            "planner/backends/shared/d.py": "if True:\n    import planner.backends.splines.cubic",
            "planner/errors.py": "import planner",
            "planner/limits.py": "",
            "planner/nowhere.py": "",
        },
        {
            "planner/kinematics/a.py:1",
            "planner/backends/ruckig/a.py:1",
            "planner/backends/shared/d.py:2",
            "planner/errors.py:1",
            "planner/nowhere.py:1",
        },
    ),
    "missing-name": (
        {
            "api/a.py": "import os\nif True:\n    B = 1\ndef run(): ...",
            "tests/b.py": "from api import a\nfrom api.a import B, os, run\nfrom api.a import no\nfrom os import no",
        },
        {"tests/b.py:3"},
    ),
    "relative-import": ({"cli/a.py": "from . import b"}, {"cli/a.py:1"}),
    "stranger": (
        {
            "planner/constraints/rows.py": "import planner.constraints.a",
            "planner/constraints/a.py": "import planner.constraints.peaks",
            "planner/constraints/peaks.py": "",
        },
        {"planner/constraints/rows.py:1"},
    ),
    "accuracy-page": (
        {"planner/a.py": 'A = 1e-9\n"""Length, m."""\nB = 1.0', "docs/constants.md": PAGE.replace("1e-09", "2e-09")},
        {f"docs/constants.md:{len(PAGE.splitlines())}"},
    ),
    "constant": (
        {"planner/a.py": 'A, B = 1, 2\n"""Both."""\nC = 1\nD = 1\n"""Of the whole."""\nE = 1\n"""The number."""'},
        {"planner/a.py:1", "planner/a.py:3", "planner/a.py:4"},
    ),
    "constant-value": (
        {"planner/a.py": "A = 1\nB = 1", "planner/b.py": "B = 1\n\nA = 2"},
        {"planner/a.py:1", "planner/b.py:3"},
    ),
    "fragment": (
        {
            "planner/a.py": '"""The start, s."""\ndef f():\n    """(N,), s."""\ndef g():\n    """Where it is."""',
            "planner/b.py": 'class A:\n    """Rows"""',
        },
        {"planner/a.py:3", "planner/a.py:5", "planner/b.py:2"},
    ),
    "large-folder": ({f"cli/{name}.py": "" for name in ["__init__", *"abcdefghijklmn"]}, {"cli/__init__.py:1"}),
    "long-file": ({"api/a.py": "\n" * 401, "api/b.py": "\n" * 400}, {"api/a.py:401"}),
    "private-name": (
        {"planner/a.py": "replaced_residue = 1\nby_place = 2\nf(dueDates=3)\nx.OWNERS_OF"},
        {"planner/a.py:2", "planner/a.py:3", "planner/a.py:4"},
    ),
    "request-value": (
        {"planner/a.py": 'x = "/waypoints/0"\ny = {"kind": "joint"}', "planner/robots/b.py": 'y = {"kind": "joint"}'},
        {"planner/a.py:1", "planner/a.py:2"},
    ),
    "clause": (
        {
            "docs/a.md": "What is a path?\n\n- It shows\n  what is planned.\n\n```\nwhat is\n```\n",
            "api/a.py": '"""Limits, those of it."""',
        },
        {"docs/a.md:4", "api/a.py:1"},
    ),
    "long-sentence": (
        {
            "docs/a.md": f"# {LONG}\n\nOne.\nTwo. {LONG}\n\n`{LONG}`\n\n| a | {LONG} |\n",
            "api/a.py": f'def f():\n    """Return.\n\n    >>> 1\n    {LONG}\n\n    Args:\n        a: {LONG}"""',
            "api/b.py": f"x = '{LONG}'",
        },
        {"docs/a.md:4", "docs/a.md:8", "api/a.py:8"},
    ),
    "long-summary": ({"api/a.py": f'def f():\n    """{LONG}"""\n' + A_VERB}, {"api/a.py:2"}),
    "term": (
        {"README.md": "6 degrees of freedom.\nA posture. The\ntime law. It holds it against it. The law of sines.\n"},
        {"README.md:2", "README.md:3"},
    ),
    "verb": (
        {
            "api/a.py": f'{A_VERB}def g():\n    """Whether it is."""',
            "api/b.py": '@property\ndef h():\n    """So."""\ndef test_it():\n    """So."""',
        },
        {"api/a.py:4"},
    ),
}
"""Files of each rule, and the lines with faults."""


@pytest.mark.parametrize("rule", RULES)
def test_a_rule_finds_made_up_faults_and_nothing_else(rule: str) -> None:
    files, expected = CASES[rule]
    found = RULES[rule]([Source(file, text) for file, text in files.items()])
    assert {f"{fault.file}:{fault.line}" for fault in found} == expected


def test_the_baseline_lets_counts_fall_and_files_move() -> None:
    allowed = {("a.py", "term"): 3, ("b.py", "term"): 1}
    a, b, new = allowed | {("a.py", "term"): 4}, {("a.py", "term"): 2, ("b.py", "term"): 1}, ("c.py", "term")
    assert compare(allowed, allowed) == (set(), 0)
    assert compare(a, allowed) == ({("a.py", "term")}, 0)
    assert compare(b, allowed) == (set(), 1)
    assert compare(b | {new: 1}, allowed) == (set(), 1)  # text that moved
    assert compare(b | {new: 2}, allowed) == ({new}, 1)
    assert compare(b | {("c.py", "verb"): 1}, allowed) == ({("c.py", "verb")}, 1)
    assert lowered(a, allowed) == allowed
    assert lowered(b | {new: 1}, allowed) == b | {new: 1}
    assert lowered(b | {new: 2}, allowed) == b
