"""Kinds, choices and options in the schema of plan requests, as factors with levels."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from api.contract.requests import PlanRequest
from tests.api.combinations.covering import Factor

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from tests.api.combinations.covering import Row

COUNT = 4
"""Number of waypoints of a request."""

NONE = "none"
"""The level of a factor that adds no field."""

TOOL_MOTIONS = ("linear", "circular", "polyline", "spline")
ROBOTS = ("kuka_kr16_2", "fr3", "on_a_rail", "arm_of_shapes", "date_sorting_arm", "three_dof_arm")

WITHOUT_INERTIAS = ("three_dof_arm", "date_sorting_arm")
WITHOUT_CONFIGURATIONS = {
    "three_dof_arm": ("shoulder", "elbow", "wrist"),
    "date_sorting_arm": ("elbow",),
    "fr3": ("shoulder", "elbow", "wrist"),
    "arm_of_shapes": ("shoulder", "elbow", "wrist"),
}
"""Parts of the configuration that robots do not have."""

AT_VELOCITY = "through at a velocity"
PASSED = ("through", "blend", AT_VELOCITY)
BROKEN_ONCE: list[Row] = [
    {"robot": "fr3", "goal 0": "position", "axes 1": "tool", "motion 2": "free"},
    {"robot": "kuka_kr16_2", "backend": "min_effort", "duration": "given", "timing 1": "minimum_duration"},
]
"""Levels that together once gave wrong plans: the waypoint missed, and a segment shorter than its least duration."""

RESTING = {"dwell": ["given"], "action": ["wait"], "carries": ["payload", "put_down"]}
"""Fields that a waypoint may have only where the robot stops."""


@cache
def schema() -> dict[str, Any]:
    """Return the JSON schema of plan requests."""
    return PlanRequest.model_json_schema()


def kinds(union: str) -> tuple[str, ...]:
    """Return the kinds of a discriminated union."""
    return tuple(schema()["$defs"][union]["discriminator"]["mapping"])


def choices(definition: str, name: str | None = None) -> tuple[str, ...]:
    """Return the permitted strings of a definition or of one of its properties."""
    node = schema()["$defs"][definition]
    node = node if name is None else node["properties"][name]
    while "$ref" in node:
        node = schema()["$defs"][node["$ref"].rpartition("/")[2]]
    options = [node, *node.get("anyOf", [])]
    return tuple(level for option in options for level in option.get("enum", [option.get("const")]) if level)


def backends() -> tuple[str, ...]:
    """Return every back end, and every option of it: `toppra`, `toppra jerk_limited`, `ruckig synchronization time`."""
    found = []
    for kind, reference in schema()["$defs"]["Backend"]["discriminator"]["mapping"].items():
        found.append(kind)
        for name, option in schema()["$defs"][reference.rpartition("/")[2]]["properties"].items():
            if name != "kind":
                levels = [f" {level}" for level in option.get("enum", []) if level != option["default"]]
                found += [f"{kind} {name}{level}" for level in levels or [""]]
    return tuple(found)


def factors() -> list[Factor]:
    """Return all factors of a request, each after the factors that it needs."""
    limits = tuple(schema()["$defs"]["Limits"]["properties"])
    regions = ("rotation_z alone", *schema()["$defs"]["Region"]["properties"], "all")
    found = [
        Factor("robot", ROBOTS, group="robots"),
        Factor("backend", backends(), group="times"),
        Factor("duration", (NONE, "given"), group="times"),
        Factor("limits", (NONE, *limits)),
        Factor("prefer", choices("Preference")),
        Factor("ik", (NONE, "reference", "tolerances")),
        Factor("tool", (NONE, "given")),
        Factor("mounting", (NONE, "given")),
        Factor("payload", (NONE, "given")),
        Factor("start_tolerance", (NONE, "given")),
        Factor("object", (NONE, *kinds("SceneShape"))),
        Factor("attached", (NONE, *kinds("SolidShape"))),
        Factor("self_collision", (NONE, "true", "false")),
        Factor("speed_zones", (NONE, "given", "of an object"), {"object": kinds("SceneShape")}),
        Factor("residual_vibration", (NONE, "reported")),
        Factor("handled", (NONE, "attach", "attach and detach"), {"object": kinds("SolidShape")}),
        Factor("action", (NONE, *kinds("Action"))),
        Factor("moment", tuple(schema()["$defs"]["ActionMoment"]["properties"]), {"action": kinds("Action")}),
    ]
    for k in range(COUNT):
        found += _of_goal(k, regions)
        found += _of_motion(k) if k else []
        found += [
            Factor(f"dwell {k}", (NONE, "given")),
            Factor(f"tool {k}", (NONE, "given")),
            Factor(f"carries {k}", (NONE, "payload", "put_down")),
            Factor(f"action {k}", (NONE, *kinds("WaypointAction"))),
        ]
    return found


def plain_factors() -> list[Factor]:
    """Return the factors; a factor without a group has only its first level."""
    return [factor if factor.group else factor._replace(levels=factor.levels[:1]) for factor in factors()]


def _of_goal(k: int, regions: tuple[str, ...]) -> list[Factor]:
    goals = [kind for kind in kinds("SingleWaypoint") if k or kind != "relative"]
    goal, posed = f"goal {k}", ("pose", "position")
    return [
        Factor(goal, (*goals, "position"), group="goals"),
        Factor(f"notation {k}", kinds("Orientation"), {goal: ["pose"]}),
        Factor(f"free {k}", (NONE, *regions), {goal: ["pose"]}),
        Factor(f"frame {k}", (NONE, "base", "world", "pallet"), {goal: posed}),
        Factor(f"configuration {k}", (NONE, *schema()["$defs"]["ArmConfiguration"]["properties"]), {goal: ["pose"]}),
        Factor(f"external {k}", (NONE, "given"), {goal: posed, "robot": ["on_a_rail"]}),
        *([Factor(f"axes {k}", choices("RelativeWaypoint", "frame"), {goal: ["relative"]}, "goals")] if k else []),
        *([Factor(f"move {k}", (*kinds("Move"), "turned"), {goal: ["relative"]})] if k else []),
    ]


def _of_motion(k: int) -> list[Factor]:
    motion = f"motion {k}"
    found = [
        Factor(motion, kinds("Motion"), group="goals"),
        Factor(f"timing {k}", (NONE, "duration", "minimum_duration"), group="times"),
        Factor(f"limits {k}", (NONE, "joints", "tool")),
        Factor(f"turns {k}", choices("JointMotion", "turns"), {motion: ["joint"]}),
        Factor(f"singularity {k}", choices("LinearMotion", "singularity"), {motion: TOOL_MOTIONS}),
        Factor(f"open {k}", (NONE, "rotation_z alone", "all"), {motion: TOOL_MOTIONS}),
        Factor(f"tolerance {k}", (NONE, "given"), {motion: TOOL_MOTIONS}),
        Factor(f"optimise {k}", (NONE, "checks", *choices("FreeMotion", "optimise")), {motion: ["free"]}),
    ]
    if k < COUNT - 1:
        found.append(Factor(f"passing {k}", (*kinds("Transition"), AT_VELOCITY), group="times"))
    return found


def refused() -> list[Mapping[str, Collection[str]]]:
    """Return levels that the words of the schema and of the documentation refuse together."""
    curved = [kind for kind in kinds("Motion") if kind != "joint"]
    initial, final = ["ruckig initial_velocity", "ruckig initial_acceleration"], ["ruckig final_velocity"]
    without_velocities = [one for one in backends() if one.split()[0] not in ("cubic", "quintic", "ruckig", "auto")]
    without_times = [one for one in backends() if one.split()[0] in ("ruckig", "toppra", "trapezoidal")]
    rules: list[Mapping[str, Collection[str]]] = [
        {"robot": WITHOUT_INERTIAS, "limits": ["torque", "torque_range", "power", "total_power", "rms_torque"]},
        {"robot": WITHOUT_INERTIAS, "backend": [one for one in backends() if one.startswith("min_effort")]},
        {"duration": ["given"], "timing 1": ["duration"], "timing 2": ["duration"], "timing 3": ["duration"]},
        {"prefer": ["near_reference"], "ik": [NONE, "tolerances"]},
        {"handled": ["attach", "attach and detach"], "passing 1": PASSED},
        {"handled": ["attach and detach"], "passing 2": PASSED},
        {"backend": initial, "motion 1": curved},
        {"backend": initial, "passing 1": PASSED, "motion 2": curved},
        {"backend": initial, "passing 1": PASSED, "passing 2": PASSED, "motion 3": curved},
        {"backend": final, "motion 3": curved},
        {"backend": final, "passing 2": PASSED, "motion 2": curved},
        {"backend": final, "passing 2": PASSED, "passing 1": PASSED, "motion 1": curved},
        *({"backend": initial, f"{rest} 0": levels} for rest, levels in RESTING.items()),
        *({"backend": final, f"{rest} {COUNT - 1}": levels} for rest, levels in RESTING.items()),
        {"backend": initial, "passing 1": ["blend"]},
        {"backend": initial, "passing 1": PASSED, "passing 2": ["blend"]},
        {"backend": final, "passing 2": ["blend"]},
        {"backend": final, "passing 2": PASSED, "passing 1": ["blend"]},
        {"passing 1": [AT_VELOCITY], "passing 2": ["blend"]},
        {"passing 2": [AT_VELOCITY], "passing 1": ["blend"]},
        {"action": ["wait"], "moment": ["distance", "time"]},
        {"action": ["wait"], "passing 1": PASSED},
        {"passing 1": [AT_VELOCITY], "passing 2": PASSED, "motion 3": curved},
        {"passing 2": [AT_VELOCITY], "passing 1": PASSED, "motion 1": curved},
    ]
    for k in range(COUNT):
        rules += [
            {"robot": ["three_dof_arm"], f"goal {k}": ["pose"]},
            {"robot": ["three_dof_arm"], f"move {k}": ["cylindrical", "spherical", "turned"]},
            {f"motion {k}": ["free"], f"timing {k}": ["duration", "minimum_duration"]},
            {f"passing {k}": [AT_VELOCITY], f"motion {k}": curved},
            {f"passing {k}": [AT_VELOCITY], f"motion {k + 1}": curved},
            {f"passing {k}": [AT_VELOCITY], "backend": without_velocities},
            {f"passing {k}": ["through"], f"motion {k}": TOOL_MOTIONS, f"motion {k + 1}": TOOL_MOTIONS},
            {f"passing {k}": PASSED, f"timing {k}": ["duration"], "backend": without_times},
            {f"passing {k}": PASSED, f"timing {k + 1}": ["duration"], "backend": without_times},
            {f"passing {k}": PASSED, f"tool {k + 1}": ["given"]},
            *({f"passing {k}": PASSED, f"{rest} {k}": levels} for rest, levels in RESTING.items()),
            *({"robot": [robot], f"configuration {k}": sides} for robot, sides in WITHOUT_CONFIGURATIONS.items()),
        ]
    return rules
