"""C header: the polynomials of a trajectory and a function that evaluates them, for microcontrollers."""

from __future__ import annotations

from planner.export.base import ExportOptions, Format, refuse_actions
from planner.export.programs import on_one_line, origin
from planner.kinematics import FloatArray
from planner.plans.result import Plan

EVALUATION = """\
// Writes position and velocity at a time, s. An earlier or later time counts as the start or the end.
static inline void planned_evaluate(
    planned_real time, planned_real position[PLANNED_JOINTS], planned_real velocity[PLANNED_JOINTS]) {
  int first = 0, last = PLANNED_PIECES - 1;
  if (!(time > planned_breakpoints[0])) time = planned_breakpoints[0];
  if (time > planned_breakpoints[PLANNED_PIECES]) time = planned_breakpoints[PLANNED_PIECES];
  while (first < last) {
    const int middle = first + (last - first + 1) / 2;
    if (time < planned_breakpoints[middle]) last = middle - 1;
    else first = middle;
  }
  time -= planned_breakpoints[first];
  for (int joint = 0; joint < PLANNED_JOINTS; joint++) {
    const planned_real *powers = planned_coefficients[first][joint];
    planned_real value = 0, slope = 0;
    for (int power = PLANNED_ORDER - 1; power >= 0; power--) {
      slope = slope * time + value;
      value = value * time + powers[power];
    }
    position[joint] = value;
    velocity[joint] = slope;
  }
}"""
"""The function of the header: Horner's rule in the piece that a binary search finds."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write the polynomials of a plan as a C99 header that allocates no memory.

    Raises:
        UnsupportedFormat: The plan has actions.
    """
    del options  # the polynomials have no sample period
    refuse_actions(plan, "c_header")
    robot, trajectory = plan.path.robot, plan.trajectory
    pieces, joints, order = trajectory.coefficients.shape
    units = ("rad" if is_angle else "m" for is_angle in robot.is_angle)
    lines = [
        f"// {origin(plan)}",
        *(
            f"// joint {i}: {on_one_line(name)} in {unit}"
            for i, (name, unit) in enumerate(zip(robot.joint_names, units, strict=True))
        ),
        "#ifndef PLANNED_TRAJECTORY_H",
        "#define PLANNED_TRAJECTORY_H",
        "// Define PLANNED_REAL as float before this header for single precision.",
        "#ifndef PLANNED_REAL",
        "#define PLANNED_REAL double",
        "#endif",
        "typedef PLANNED_REAL planned_real;",
        f"#define PLANNED_JOINTS {joints}",
        f"#define PLANNED_PIECES {pieces}",
        f"#define PLANNED_ORDER {order}",
        "// Starts of the pieces and the end, s.",
        f"static const planned_real planned_breakpoints[PLANNED_PIECES + 1] = {_braces(trajectory.breakpoints)};",
        "// Ascending powers of the time since the start of the piece.",
        "static const planned_real planned_coefficients[PLANNED_PIECES][PLANNED_JOINTS][PLANNED_ORDER] = {",
        *(f"  {{{', '.join(map(_braces, piece))}}}," for piece in trajectory.coefficients),
        "};",
        EVALUATION,
        "#endif",
    ]
    return ("\n".join(lines) + "\n").encode()


def _braces(values: FloatArray) -> str:
    return "{" + ", ".join(map(repr, values.tolist())) + "}"


FORMAT = Format("c_header", "text/x-c-header", ".h", render)
"""The form of C headers."""
