"""The figures of the documents and the commands that draw them: docs/figures.md, and the pictures that it shows.

Run: python -m docs.tools.figures
"""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/figures.md"
IMAGES = ROOT / "docs/images/figures"

DOCUMENTS = {
    "000": "Document 000, natural gas refuelling",
    "002": "Document 002, the three-joint arm",
    "004": "Document 004, date sorting",
}
"""The documents whose figures are drawn, and their headings."""

PICTURED = ("4.2", "4.9", "3.0", "7", "9", "21", "31")
"""The figures that the page shows."""

HEADER = """\
# Figures of the documents

Every figure of the documents that comes out of a computation is one command here. The tests run all of them and read
the curves back out of the pictures. To the accuracy of a picture, they are the documents' own polynomials, lines and
formulas. `planner plot` writes `.svg` or `.png`; figure 4.4, for example, is

```console
$ planner plot examples/refuelling_case_1.json --show position --show velocity --joint joint_1 -o figure.svg
```

The service draws the same by one request: the names are the values of `picture` in the body ([forms of a
plan](formats.md#pictures)).

```console
$ jq '. + {"picture": {"show": ["position", "velocity"], "joints": ["joint_1"]}}' examples/refuelling_case_1.json |
    curl -s "http://127.0.0.1:8000/v1/trajectories?format=svg" --json @- -o figure.svg
```

Figures that are not here are drawings, photographs and listings, which no request draws. Document 001 has drawings
only. Figures 6 to 8 of document 004 are screenshots of a simulation, of the arm at the points of Table 2. Here they are
stick models at these points (270° of point 5 as -90°, inside the limits of Table 1). Its figures 36 and 37 are called
"alternative planning approach"; the text gives neither the motion nor a number. Here they are the first transition
planned in another way. Its joints go straight from point 1 to point 2 as polynomials of degree 5, in the same 30 s.
"""


@dataclass(frozen=True)
class Figure:
    """A figure of a document.

    Attributes:
        document: The document's number.
        number: The figure's number.
        shows: Its content.
        command: The arguments of `planner` that draw it, but for the file.
    """

    document: str
    number: str
    shows: str
    command: tuple[str, ...]

    @property
    def line(self) -> str:
        """The whole command."""
        option, suffix = ("--report", "html") if self.command[0] == "plan" else ("-o", "svg")
        return shlex.join(("planner", *self.command, option, f"{self.name}.{suffix}"))

    @property
    def name(self) -> str:
        """The name of its file, without a suffix."""
        return f"figure_{self.document}_{self.number.replace('.', '_').replace(' ', '_')}"


def _drawn(document: str, number: str, shows: str, drawn: str, *show: str, **options: str | list[str]) -> Figure:
    """Make a figure that `planner plot` draws."""
    command = ["plot", drawn]
    for name in show:
        command += ["--show", name]
    for option, values in options.items():
        for value in [values] if isinstance(values, str) else values:
            command += [f"--{option}", value]
    return Figure(document, number, shows, tuple(command))


def _refuelling() -> list[Figure]:
    figures = [
        _drawn("000", "4.1", "the model of the robot", "ngv_refuelling_arm_published"),
        _drawn("000", "4.2", "the robot at the points of case 1", "examples/refuelling_case_1.json", "robot"),
        _drawn("000", "4.3", "the robot at the points of case 2", "examples/refuelling_case_2.json", "robot"),
    ]
    number = 4
    for case in (1, 2):
        request = f"examples/refuelling_case_{case}.json"
        for joint in (1, 2, 3, 5, 6):
            shows = f"joint {joint}, angle and velocity, case {case}"
            graphs = ("position", "velocity")
            figures.append(_drawn("000", f"4.{number}", shows, request, *graphs, joint=f"joint_{joint}"))
            number += 1
        figures.append(_drawn("000", f"4.{number}", f"all joints, case {case}", request, "position", "velocity"))
        number += 1
    return figures


def _three_joint_arm() -> list[Figure]:
    request = "examples/three_joint_arm_first.json"
    quantities = ("position", "velocity", "acceleration")
    return [
        _drawn("002", f"3.{3 * k + row}", f"{quantity} along {axis}", request, f"tcp_{quantity}", axis=axis)
        for k, axis in enumerate("xyz")
        for row, quantity in enumerate(quantities)
    ]


def _date_sorting() -> list[Figure]:
    arm, first, second = (
        "date_sorting_arm",
        "examples/date_sorting_transition_1.json",
        "examples/date_sorting_transition_2.json",
    )
    turning, sliding = ["theta1", "theta2", "theta3", "theta4"], ["l1", "l2"]
    views = (("9", "isometric"), ("10", "xy"), ("11", "xz"), ("12", "yz"))
    alternative = "examples/date_sorting_alternative.json"
    return [
        _drawn("004", "6", "the robot at points 1 and 2", "examples/date_sorting_points_1_2.json", "robot"),
        _drawn("004", "7", "the robot at points 3 and 4", "examples/date_sorting_points_3_4.json", "robot"),
        _drawn("004", "8", "the robot at point 5", "examples/date_sorting_point_5.json", "robot"),
        *(_drawn("004", number, f"workspace, {view}", arm, "workspace", view=view) for number, view in views),
        _drawn("004", "16", "path of the tool, by its speed", first, "path"),
        _drawn("004", "17", "speed of the tool", first, "tcp_speed"),
        Figure("004", "section 8", "the animation: the report plays it", ("plan", first)),
        _drawn("004", "21", "position and orientation along the path", first, "path"),
        _drawn("004", "22", "position of the tool", first, "tcp_position"),
        _drawn("004", "23", "roll, pitch and yaw of the tool", first, "tcp_orientation"),
        _drawn("004", "25", "angles of the joints", first, "position", joint=turning),
        _drawn("004", "26", "extensions of the joints", first, "position", joint=sliding),
        _drawn("004", "27", "velocity of the tool", first, "tcp_velocity"),
        _drawn("004", "29", "position and velocity of the tool, its derivative", first, "tcp_position", "tcp_velocity"),
        _drawn("004", "30", "torques of a mass of 1 kg", second, "torque", joint=turning),
        _drawn("004", "31", "forces of a mass of 1 kg", second, "torque", joint=sliding),
        _drawn("004", "32", "angles of the joints, transition 2", second, "position", joint=turning),
        _drawn("004", "33", "extensions of the joints, transition 2", second, "position", joint=sliding),
        _drawn("004", "34", "velocities of joints that turn, transition 2", second, "velocity", joint=turning),
        _drawn("004", "35", "velocities of joints that slide, transition 2", second, "velocity", joint=sliding),
        _drawn("004", "36", "path of the tool, planned otherwise", alternative, "path"),
        _drawn("004", "37", "speed of the tool, planned otherwise", alternative, "tcp_speed"),
    ]


FIGURES = (*_refuelling(), *_three_joint_arm(), *_date_sorting())
"""Every figure, in the order of the documents."""


def document() -> str:
    """Write the page."""
    parts = [HEADER]
    for number, figures in groupby(FIGURES, key=lambda figure: figure.document):
        rows = list(figures)
        parts.append(f"## {DOCUMENTS[number]}\n")
        parts += [
            f"![Figure {figure.number}, {figure.shows}](images/figures/{figure.name}.png)\n"
            for figure in rows
            if figure.number in PICTURED
        ]
        parts.append("| figure | shows | command |\n|---|---|---|")
        parts += [f"| {figure.number} | {figure.shows} | `{figure.line}` |" for figure in rows]
        parts.append("")
    return "\n".join(parts)


def main() -> None:
    """Draw the pictures and write the page."""
    from typer.testing import CliRunner

    from cli import app

    IMAGES.mkdir(parents=True, exist_ok=True)
    for figure in FIGURES:
        if figure.number in PICTURED:
            CliRunner().invoke(app, [*figure.command, "-o", str(IMAGES / f"{figure.name}.png")], catch_exceptions=False)
    PAGE.write_text(document(), encoding="utf-8")


if __name__ == "__main__":
    main()
