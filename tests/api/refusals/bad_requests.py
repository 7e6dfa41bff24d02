"""The table of bad requests: each body, and the code and pointer of its refusal."""

from __future__ import annotations

import json
from typing import Any

from tests.api.refusals.bad_kinematics import BAD_KINEMATICS
from tests.api.refusals.bad_robots import BAD_ROBOTS, Bad
from tests.api.requests import IDENTITY, joint, plan_request, pose_waypoint, relative_waypoint, validate_request

PLAN = "/v1/trajectories"
VALIDATE = "/v1/trajectories/validate"
FORWARD = "/v1/kinematics/forward"
INVERSE = "/v1/kinematics/inverse"


def waypoints(*points: Any) -> dict[str, Any]:
    return plan_request(waypoints=list(points))


def second(waypoint: Any) -> dict[str, Any]:
    return waypoints(joint(0.1, 0.2, 0.3), waypoint)


def second_changed(**changes: Any) -> dict[str, Any]:
    return second(joint(0.3, 0.1, 0.5, **changes))


def text(body: str) -> bytes:
    return body.encode()


def plan_text(waypoint: str) -> bytes:
    """Return a plan request whose second waypoint is a text, for values that Python's JSON cannot write."""
    return text(json.dumps(second("HERE")).replace('"HERE"', waypoint))


def rotated(orientation: Any) -> dict[str, Any]:
    return second(pose_waypoint([0.1, 0.1, 0.1], orientation))


def samples(**changes: Any) -> dict[str, Any]:
    request = validate_request()
    return request | {"samples": request["samples"] | changes}


AT_ONCE = samples(time=[0.0, 5e-324, 1.0])
OF_A_TRAJECTORY = {"robot": "three_dof_arm", "trajectory": {"samples": AT_ONCE["samples"]}}


def polynomials(joints: str = "123", other: Any = None, **changes: Any) -> dict[str, Any]:
    """Return polynomials of two pieces for a three-joint arm at rest; `other` sets the breakpoints of two joints."""
    still = {"breakpoints": [0.0, 1.0, 2.0], "coefficients": [[0.1, 0.0], [0.1, 0.0]]} | changes
    curves = [{"joint": f"joint_{number}", **still} for number in joints]
    for curve in curves[1:]:
        curve["breakpoints"] = other or curve["breakpoints"]
    return {"robot": "three_dof_arm", "polynomials": curves}


ORIGIN = {"position": [0.0, 0.0, 0.0]}


def in_frame(name: str, **changes: Any) -> dict[str, Any]:
    """Return a request for a pose in a frame, with further fields."""
    return plan_request(waypoints=[joint(0.1, 0.2, 0.3), pose_waypoint([0.2, 0.0, 0.1], frame=name)], **changes)


def configured(**names: Any) -> dict[str, Any]:
    return second(pose_waypoint([0.1, 0.1, -0.1], configuration=names))


def singular(how: str) -> dict[str, Any]:
    return second_changed(motion={"kind": "linear", "singularity": how})


def setting(value: Any) -> dict[str, Any]:
    action = {"at": {"waypoint": 1}, "kind": "set_output", "name": "grip", "value": value}
    return plan_request(actions=[action])


INVALID = "invalid_request"
VIA_AT_START = {"position": [0.26582269183668716, 0.026671232618305785, -0.00289525224954534], "orientation": None}
"""The tool of the arm with three joints at (0.1, 0.2, 0.3)."""
PASSED_SLOWLY = {"kind": "through", "velocity": [0.1, 0.1, 0.1]}
A, B, C = joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5), joint(0.2, 0.2, 0.2)

BAD_REQUESTS = [
    # Not JSON, or not the JSON that is meant.
    Bad("singular how", PLAN, singular("stop"), INVALID, "/waypoints/1/motion/singularity"),
    Bad(
        "no such position",
        PLAN,
        plan_request(waypoints=[{"kind": "named", "name": "home"}]),
        INVALID,
        "/waypoints/0/name",
    ),
    Bad("a position of no name", PLAN, plan_request(waypoints=[{"kind": "named"}]), INVALID, "/waypoints/0/name"),
    Bad("no such frame", PLAN, in_frame("pallet"), INVALID, "/waypoints/1/frame"),
    Bad("a frame of no name", PLAN, in_frame(""), INVALID, "/waypoints/1/frame"),
    Bad("the base somewhere else", PLAN, in_frame("base", frames={"base": ORIGIN}), INVALID, "/frames/base"),
    Bad("the world somewhere else", PLAN, in_frame("base", frames={"world": ORIGIN}), INVALID, "/frames/world"),
    Bad("a frame without a place", PLAN, in_frame("a", frames={"a": {}}), INVALID, "/frames/a/position"),
    Bad(
        "a mounting in a request without axes",
        PLAN,
        in_frame("base", mounting=ORIGIN),
        INVALID,
        "/mounting/orientation",
    ),
    Bad("no such side", PLAN, configured(elbow="left"), INVALID, "/waypoints/1/configuration/elbow"),
    Bad("no such part", PLAN, configured(knee="up"), INVALID, "/waypoints/1/configuration/knee"),
    Bad("a part that the arm lacks", PLAN, configured(wrist="flip"), INVALID, "/waypoints/1/configuration/wrist"),
    Bad("empty body", PLAN, b"", INVALID, ""),
    Bad("blank body", PLAN, b"   ", INVALID, ""),
    Bad("not json", PLAN, b"robot: ur5", INVALID, ""),
    Bad("cut off", PLAN, b'{"robot": "three_dof', INVALID, ""),
    Bad("invalid utf-8", PLAN, b'{"robot": "\xff\xfe"}', INVALID, ""),
    Bad("lone surrogate", PLAN, b'{"robot": "\\ud800"}', INVALID, ""),
    Bad("nan literal", PLAN, plan_text('{"kind": "joint", "position": [NaN, 0, 0]}'), INVALID, ""),
    Bad("infinity literal", PLAN, plan_text('{"kind": "joint", "position": [Infinity, 0, 0]}'), INVALID, ""),
    Bad("minus infinity", PLAN, plan_text('{"kind": "joint", "position": [-Infinity, 0, 0]}'), INVALID, ""),
    Bad("1e999", PLAN, plan_text('{"kind": "joint", "position": [1e999, 0, 0]}'), INVALID, ""),
    Bad("deep nesting", PLAN, b"[" * 100_000, INVALID, ""),
    Bad("deep nesting in a field", PLAN, plan_text("[" * 500 + "]" * 500), INVALID, ""),
    Bad("a list", PLAN, [plan_request()], INVALID, ""),
    Bad("null", PLAN, b"null", INVALID, ""),
    Bad("a number", PLAN, b"42", INVALID, ""),
    Bad("empty object", PLAN, {}, INVALID, "/robot"),
    # Fields.
    Bad("unknown field", PLAN, plan_request(speed=1.0), INVALID, "/speed"),
    Bad("unknown field of a waypoint", PLAN, second_changed(speed=1.0), INVALID, "/waypoints/1/speed"),
    Bad("unknown field with a slash", PLAN, plan_request(**{"a/b~c": 1}), INVALID, "/a~1b~0c"),
    Bad("missing waypoints", PLAN, {"robot": "three_dof_arm"}, INVALID, "/waypoints"),
    Bad("missing position", PLAN, second({"kind": "joint"}), INVALID, "/waypoints/1/position"),
    Bad("missing kind", PLAN, second({"position": [0, 0, 0]}), INVALID, "/waypoints/1/kind"),
    Bad("unknown kind", PLAN, second({"kind": "teleport"}), INVALID, "/waypoints/1/kind"),
    Bad("kind of another type", PLAN, second({"kind": 3}), INVALID, "/waypoints/1/kind"),
    Bad("waypoint null", PLAN, second(None), INVALID, "/waypoints/1"),
    Bad("unknown back end", PLAN, plan_request(backend={"kind": "magic"}), INVALID, "/backend/kind"),
    Bad("back end as a string", PLAN, plan_request(backend="cubic"), INVALID, "/backend"),
    Bad(
        "option of another back end",
        PLAN,
        plan_request(backend={"kind": "cubic", "acceleration_time": 1.0}),
        INVALID,
        "/backend/acceleration_time",
    ),
    Bad(
        "negative time of the back end",
        PLAN,
        plan_request(backend={"kind": "trapezoidal", "acceleration_time": -1.0}),
        INVALID,
        "/backend/acceleration_time",
    ),
    Bad("unknown motion", PLAN, second_changed(motion={"kind": "spiral"}), INVALID, "/waypoints/1/motion/kind"),
    Bad("motion without a kind", PLAN, second_changed(motion={}), INVALID, "/waypoints/1/motion/kind"),
    Bad("circle without via", PLAN, second_changed(motion={"kind": "circular"}), INVALID, "/waypoints/1/motion/via"),
    Bad(
        "via that is no pose",
        PLAN,
        second_changed(motion={"kind": "circular", "via": [0.1, 0.0, 0.1]}),
        INVALID,
        "/waypoints/1/motion/via",
    ),
    Bad(
        "circle through its own start",
        PLAN,
        plan_request(
            waypoints=[
                joint(0.1, 0.2, 0.3),
                joint(0.2, 0.3, 0.4) | {"motion": {"kind": "circular", "via": VIA_AT_START}},
            ]
        ),
        INVALID,
        "/waypoints/1/motion/via",
    ),
    Bad(
        "tolerance of nothing",
        PLAN,
        second_changed(motion={"kind": "linear", "tolerance_position": 0.0}),
        INVALID,
        "/waypoints/1/motion/tolerance_position",
    ),
    Bad(
        "tolerance not a number",
        PLAN,
        second_changed(motion={"kind": "linear", "tolerance_orientation": "fine"}),
        INVALID,
        "/waypoints/1/motion/tolerance_orientation",
    ),
    Bad(
        "tolerance of a joint motion",
        PLAN,
        second_changed(motion={"kind": "joint", "tolerance_position": 1e-4}),
        INVALID,
        "/waypoints/1/motion/tolerance_position",
    ),
    Bad(
        "unknown transition",
        PLAN,
        second_changed(transition={"kind": "jump"}),
        INVALID,
        "/waypoints/1/transition/kind",
    ),
    Bad(
        "blend without a radius",
        PLAN,
        second_changed(transition={"kind": "blend"}),
        INVALID,
        "/waypoints/1/transition/radius",
    ),
    Bad(
        "blend of radius 0",
        PLAN,
        second_changed(transition={"kind": "blend", "radius": 0.0}),
        INVALID,
        "/waypoints/1/transition/radius",
    ),
    Bad(
        "blend with a negative radius",
        PLAN,
        second_changed(transition={"kind": "blend", "radius": -0.1}),
        INVALID,
        "/waypoints/1/transition/radius",
    ),
    Bad(
        "blend at the last waypoint",
        PLAN,
        second_changed(transition={"kind": "blend", "radius": 0.1}),
        INVALID,
        "/waypoints/1/transition",
    ),
    Bad(
        "dwell where the robot does not stop",
        PLAN,
        plan_request(
            waypoints=[
                joint(0.1, 0.2, 0.3),
                joint(0.2, 0.2, 0.3) | {"transition": {"kind": "through"}, "dwell": 1.0},
                joint(0.3, 0.2, 0.3),
            ]
        ),
        INVALID,
        "/waypoints/1/dwell",
    ),
    Bad(
        "corner of two lines passed",
        PLAN,
        plan_request(
            waypoints=[
                joint(0.1, 0.2, 0.3),
                joint(0.2, 0.2, 0.3) | {"motion": {"kind": "linear"}, "transition": {"kind": "through"}},
                joint(0.3, 0.3, 0.3) | {"motion": {"kind": "linear"}},
            ]
        ),
        INVALID,
        "/waypoints/1/transition",
    ),
    Bad("unknown include", PLAN, plan_request(include=["snap"]), INVALID, "/include/0"),
    # Numbers.
    Bad("string for a number", PLAN, second(joint(0.1, "0.2", 0.3)), INVALID, "/waypoints/1/position/1"),
    Bad("boolean for a number", PLAN, second(joint(0.1, 0.2, True)), INVALID, "/waypoints/1/position/2"),
    Bad("null for a number", PLAN, second(joint(None, 0.2, 0.3)), INVALID, "/waypoints/1/position/0"),
    Bad("list for a number", PLAN, second(joint([0.1], 0.2, 0.3)), INVALID, "/waypoints/1/position/0"),
    Bad("string for a list", PLAN, second({"kind": "joint", "position": "0 0 0"}), INVALID, "/waypoints/1/position"),
    Bad("huge angle", PLAN, second(joint(1e300, 0.2, 0.3)), INVALID, "/waypoints/1/position/0"),
    Bad("huge integer", PLAN, second(joint(10**30, 0.2, 0.3)), INVALID, "/waypoints/1/position/0"),
    Bad("fractional seed", PLAN, plan_request(seed=0.5), INVALID, "/seed"),
    Bad("negative seed", PLAN, plan_request(seed=-1), INVALID, "/seed"),
    Bad(
        "a range whose lower limit is not below 0",
        PLAN,
        plan_request(limits={"velocity_range": [[0.5, 1.0], [-1.0, 1.0], [-1.0, 1.0]]}),
        INVALID,
        "/limits/velocity_range/0",
    ),
    Bad(
        "a range of three numbers",
        PLAN,
        plan_request(limits={"acceleration_range": [[-1.0, 0.0, 1.0]]}),
        INVALID,
        "/limits/acceleration_range/0",
    ),
    Bad(
        "ranges for two of three joints",
        PLAN,
        second_changed(limits={"acceleration_range": [[-1.0, 1.0], [-1.0, 1.0]]}),
        INVALID,
        "/waypoints/1/limits/acceleration_range",
    ),
    Bad(
        "no acceleration of the tool",
        PLAN,
        plan_request(limits={"tcp_linear_acceleration": 0.0}),
        INVALID,
        "/limits/tcp_linear_acceleration",
    ),
    Bad(
        "no jerk of the tool", PLAN, plan_request(limits={"tcp_angular_jerk": 0.0}), INVALID, "/limits/tcp_angular_jerk"
    ),
    Bad(
        "a velocity at a waypoint of another back end",
        PLAN,
        plan_request(backend={"kind": "trapezoidal"})
        | {"waypoints": [joint(0.1, 0.2, 0.3), joint(0.2, 0.3, 0.4, transition=PASSED_SLOWLY), joint(0.3, 0.1, 0.5)]},
        INVALID,
        "/waypoints/1/transition/velocity",
    ),
    Bad(
        "a velocity at the last waypoint",
        PLAN,
        second_changed(transition={"kind": "through", "velocity": [0.1, 0.1, 0.1]}),
        INVALID,
        "/waypoints/1/transition",
    ),
    Bad("negative duration", PLAN, second_changed(duration=-1.0), INVALID, "/waypoints/1/duration"),
    Bad("no duration of the whole", PLAN, plan_request(duration=0.0), INVALID, "/duration"),
    Bad(
        "negative least duration", PLAN, second_changed(minimum_duration=-1.0), INVALID, "/waypoints/1/minimum_duration"
    ),
    Bad(
        "duration less than the least",
        PLAN,
        second_changed(duration=1.0, minimum_duration=2.0),
        INVALID,
        "/waypoints/1/duration",
    ),
    Bad(
        "the whole shorter than its waypoints",
        PLAN,
        plan_request(duration=3.0) | {"waypoints": [joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5, minimum_duration=4.0)]},
        INVALID,
        "/duration",
    ),
    Bad("zero duration", PLAN, second_changed(duration=0.0), INVALID, "/waypoints/1/duration"),
    Bad(
        "duration of the first",
        PLAN,
        waypoints(joint(0.1, 0.2, 0.3, duration=1.0), B),
        INVALID,
        "/waypoints/0/duration",
    ),
    Bad("negative dwell", PLAN, second_changed(dwell=-0.1), INVALID, "/waypoints/1/dwell"),
    Bad("zero sample period", PLAN, plan_request(sample_period=0.0), INVALID, "/sample_period"),
    Bad("negative sample period", PLAN, plan_request(sample_period=-0.01), INVALID, "/sample_period"),
    Bad("too many samples", PLAN, plan_request(sample_period=1e-6), INVALID, "/sample_period"),
    Bad("zero deadline", PLAN, plan_request(deadline=0), INVALID, "/deadline"),
    Bad("negative deadline", PLAN, plan_request(deadline=-5), INVALID, "/deadline"),
    Bad("deadline beyond the cap", PLAN, plan_request(deadline=1e5), INVALID, "/deadline"),
    Bad("deadline as a string", PLAN, plan_request(deadline="10"), INVALID, "/deadline"),
    # Waypoints.
    Bad("no waypoint", PLAN, waypoints(), INVALID, "/waypoints"),
    Bad("too many waypoints", PLAN, waypoints(*[A, B] * 1000), INVALID, "/waypoints"),
    Bad("too few joints", PLAN, second(joint(0.1, 0.2)), INVALID, "/waypoints/1/position"),
    Bad("too many joints", PLAN, second(joint(0.1, 0.2, 0.3, 0.4)), INVALID, "/waypoints/1/position"),
    Bad("no joints", PLAN, second(joint()), INVALID, "/waypoints/1/position"),
    Bad(
        "relative first",
        PLAN,
        waypoints(relative_waypoint({"kind": "cartesian", "translation": [0, 0, 0.1]}), B),
        INVALID,
        "/waypoints/0/kind",
    ),
    Bad(
        "relative to the world",
        PLAN,
        second(relative_waypoint({"kind": "cartesian", "translation": [0, 0, 0.1]}, frame="world")),
        INVALID,
        "/waypoints/1/frame",
    ),
    Bad(
        "flat translation",
        PLAN,
        second(relative_waypoint({"kind": "cartesian", "translation": [0, 0.1]})),
        INVALID,
        "/waypoints/1/move/translation",
    ),
    Bad(
        "unknown move", PLAN, second(relative_waypoint({"kind": "conical", "r": 1})), INVALID, "/waypoints/1/move/kind"
    ),
    Bad(
        "half a cylindrical move",
        PLAN,
        second(relative_waypoint({"kind": "cylindrical", "r": 1, "alpha": 0})),
        INVALID,
        "/waypoints/1/move/l",
    ),
    Bad("position of two numbers", PLAN, second(pose_waypoint([0.1, 0.1])), INVALID, "/waypoints/1/pose/position"),
    # Orientations.
    Bad(
        "zero quaternion",
        PLAN,
        rotated({"kind": "quaternion", "xyzw": [0, 0, 0, 0]}),
        INVALID,
        "/waypoints/1/pose/orientation/xyzw",
    ),
    Bad(
        "quaternion of norm 1.02",
        PLAN,
        rotated({"kind": "quaternion", "xyzw": [0, 0, 0, 1.02]}),
        INVALID,
        "/waypoints/1/pose/orientation/xyzw",
    ),
    Bad(
        "quaternion of three numbers",
        PLAN,
        rotated({"kind": "quaternion", "xyzw": [0, 0, 1]}),
        INVALID,
        "/waypoints/1/pose/orientation/xyzw",
    ),
    Bad(
        "quaternion by another name",
        PLAN,
        rotated({"kind": "quaternion", "wxyz": [1, 0, 0, 0]}),
        INVALID,
        "/waypoints/1/pose/orientation/xyzw",
    ),
    Bad("two angles", PLAN, rotated({"kind": "rpy", "rpy": [0, 0]}), INVALID, "/waypoints/1/pose/orientation/rpy"),
    Bad(
        "sheared matrix",
        PLAN,
        rotated({"kind": "matrix", "matrix": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}),
        INVALID,
        "/waypoints/1/pose/orientation/matrix",
    ),
    Bad(
        "reflection",
        PLAN,
        rotated({"kind": "matrix", "matrix": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}),
        INVALID,
        "/waypoints/1/pose/orientation/matrix",
    ),
    Bad(
        "matrix of zeros",
        PLAN,
        rotated({"kind": "matrix", "matrix": [[0, 0, 0]] * 3}),
        INVALID,
        "/waypoints/1/pose/orientation/matrix",
    ),
    Bad(
        "matrix of two rows",
        PLAN,
        rotated({"kind": "matrix", "matrix": [[1, 0, 0], [0, 1, 0]]}),
        INVALID,
        "/waypoints/1/pose/orientation/matrix",
    ),
    Bad(
        "string in a matrix",
        PLAN,
        rotated({"kind": "matrix", "matrix": [[1, 0, 0], [0, "1", 0], [0, 0, 1]]}),
        INVALID,
        "/waypoints/1/pose/orientation/matrix/1/1",
    ),
    Bad("orientation of no kind", PLAN, rotated({"rpy": [0, 0, 0]}), INVALID, "/waypoints/1/pose/orientation/kind"),
    Bad(
        "orientation of two kinds",
        PLAN,
        rotated({**IDENTITY, "rpy": [0, 0, 0]}),
        INVALID,
        "/waypoints/1/pose/orientation/rpy",
    ),
    # Limits, options, payload, tool.
    Bad("limits of two joints", PLAN, plan_request(limits={"velocity": [0.1, 0.1]}), INVALID, "/limits/velocity"),
    Bad("zero limit", PLAN, plan_request(limits={"velocity": [0.1, 0.0, 0.1]}), INVALID, "/limits/velocity/1"),
    Bad(
        "negative limit",
        PLAN,
        plan_request(limits={"acceleration": [0.1, 0.1, -0.1]}),
        INVALID,
        "/limits/acceleration/2",
    ),
    Bad(
        "wider than the robot's",
        PLAN,
        plan_request(limits={"velocity": [1e6, 0.1, 0.1]}),
        INVALID,
        "/limits/velocity/0",
    ),
    Bad(
        "limits of a waypoint",
        PLAN,
        second_changed(limits={"velocity": [1e6, 0.1, 0.1]}),
        INVALID,
        "/waypoints/1/limits/velocity/0",
    ),
    Bad("scale above 1", PLAN, plan_request(limits={"velocity_scale": 1.5}), INVALID, "/limits/velocity_scale"),
    Bad("tiny scale", PLAN, plan_request(limits={"velocity_scale": 1e-120}), INVALID, "/limits/velocity_scale"),
    Bad("denormal limit", PLAN, plan_request(limits={"jerk": [1e-320] * 3}), INVALID, "/limits/jerk/0"),
    Bad(
        "tiny limit of the tool",
        PLAN,
        plan_request(limits={"tcp_linear_velocity": 1e-101}),
        INVALID,
        "/limits/tcp_linear_velocity",
    ),
    Bad("denormal mass", PLAN, plan_request(payload={"mass": 1e-320}), INVALID, "/payload/mass"),
    Bad("zero scale", PLAN, plan_request(limits={"acceleration_scale": 0}), INVALID, "/limits/acceleration_scale"),
    Bad(
        "negative tool speed",
        PLAN,
        plan_request(limits={"tcp_linear_velocity": -1}),
        INVALID,
        "/limits/tcp_linear_velocity",
    ),
    Bad("zero tolerance", PLAN, plan_request(ik={"tolerance_position": 0}), INVALID, "/ik/tolerance_position"),
    Bad("short reference", PLAN, plan_request(ik={"reference": [0, 0]}), INVALID, "/ik/reference"),
    Bad("unknown preference", PLAN, plan_request(ik={"prefer": "elbow_up"}), INVALID, "/ik/prefer"),
    Bad(
        "payload that changes in passing",
        PLAN,
        plan_request(
            waypoints=[
                joint(0.1, 0.2, 0.3),
                joint(0.3, 0.1, 0.5, transition={"kind": "through"}, payload={"mass": 1.0}),
                joint(0.1, 0.2, 0.3),
            ]
        ),
        INVALID,
        "/waypoints/1/transition",
    ),
    Bad(
        "weightless payload of a waypoint",
        PLAN,
        plan_request(waypoints=[joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5, payload={"mass": 0.0})]),
        INVALID,
        "/waypoints/1/payload/mass",
    ),
    Bad(
        "payload that is taken and put down",
        PLAN,
        plan_request(waypoints=[joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5, payload={"mass": 1.0}, put_down=True)]),
        INVALID,
        "/waypoints/1/payload",
    ),
    Bad("negative payload", PLAN, plan_request(payload={"mass": -1.0}), INVALID, "/payload/mass"),
    Bad(
        "impossible inertia",
        PLAN,
        plan_request(payload={"mass": 1.0, "inertia": [1, 1, 5]}),
        INVALID,
        "/payload/inertia",
    ),
    Bad("tool without position", PLAN, plan_request(tool={"orientation": IDENTITY}), INVALID, "/tool/position"),
    # Robots that there are not, and what cannot be reached.
    Bad("unknown robot", PLAN, plan_request(robot="no_such_robot"), "unknown_robot"),
    Bad("robot as a path", PLAN, plan_request(robot="../../etc/passwd"), INVALID, "/robot"),
    Bad("robot with a long name", PLAN, plan_request(robot="r" * 10_000), INVALID, "/robot"),
    Bad("robot as a number", PLAN, plan_request(robot=7), INVALID, "/robot"),
    Bad("empty robot", PLAN, plan_request(robot=""), INVALID, "/robot"),
    Bad("out of reach", PLAN, second(pose_waypoint([50.0, 0.0, 0.0])), "unreachable_waypoint"),
    Bad(
        "beyond a position limit",
        PLAN,
        {"robot": "kuka_kr16_2", "waypoints": [joint(0, -1, 1, 0, 0, 0), joint(0, 3, 1, 0, 0, 0)]},
        "joint_position_limit",
    ),
    Bad(
        "duration of the whole too short",
        PLAN,
        {"robot": "kuka_kr16_2", "duration": 0.01, "waypoints": [joint(0, -1, 1, 0, 0, 0), joint(1, -1, 1, 0, 0, 0)]},
        "infeasible_duration",
    ),
    Bad(
        "duration too short",
        PLAN,
        {"robot": "kuka_kr16_2", "waypoints": [joint(0, -1, 1, 0, 0, 0), joint(1, -1, 1, 0, 0, 0, duration=0.01)]},
        "infeasible_duration",
    ),
    # Validation and kinematics.
    Bad("time going back", VALIDATE, samples(time=[0.0, 2.0, 1.0]), INVALID, "/samples/time/2"),
    Bad("time standing still", VALIDATE, samples(time=[0.0, 0.0, 1.0]), INVALID, "/samples/time/1"),
    Bad("one sample", VALIDATE, samples(time=[0.0], position=[[0, 0, 0]]), INVALID, "/samples/time"),
    Bad("ragged samples", VALIDATE, samples(position=[[0, 0, 0], [0, 0], [0, 0, 0]]), INVALID, "/samples/position/1"),
    Bad("fewer rows than times", VALIDATE, samples(position=[[0, 0, 0]]), INVALID, "/samples/position"),
    Bad("accelerations alone", VALIDATE, samples(acceleration=[[0, 0, 0]] * 3), INVALID, "/samples/acceleration"),
    Bad("cubics without velocities", VALIDATE, validate_request(interpolation="cubic"), INVALID, "/interpolation"),
    Bad("polynomials without any", VALIDATE, validate_request(interpolation="polynomials"), INVALID, "/polynomials"),
    Bad("an unknown interpolation", VALIDATE, validate_request(interpolation="septic"), INVALID, "/interpolation"),
    Bad("neither samples nor polynomials", VALIDATE, {"robot": "three_dof_arm"}, INVALID, "/polynomials"),
    Bad("linear without samples", VALIDATE, polynomials() | {"interpolation": "linear"}, INVALID, "/samples"),
    Bad("polynomials of a joint less", VALIDATE, polynomials(joints="12"), INVALID, "/polynomials"),
    Bad(
        "polynomials going back",
        VALIDATE,
        polynomials(breakpoints=[0.0, 2.0, 1.0]),
        INVALID,
        "/polynomials/0/breakpoints/2",
    ),
    Bad(
        "polynomials of no time",
        VALIDATE,
        polynomials(breakpoints=[1.0, 1.0, 1.0]),
        INVALID,
        "/polynomials/0/breakpoints",
    ),
    Bad("a row less", VALIDATE, polynomials(coefficients=[[0.1, 0.0]]), INVALID, "/polynomials/0/coefficients"),
    Bad(
        "ragged polynomials",
        VALIDATE,
        polynomials(coefficients=[[0.1, 0.0], [0.1]]),
        INVALID,
        "/polynomials/0/coefficients/1",
    ),
    *(
        Bad(f"samples 5e-324 s apart, {path}", path, body, INVALID, f"{pointer}/samples/time/1")
        for path, body, pointer in (
            (VALIDATE, AT_ONCE, ""),
            ("/v1/collisions/check", AT_ONCE | {"scene": {"objects": []}}, ""),
            ("/v1/trajectories/reverse", OF_A_TRAJECTORY, "/trajectory"),
            ("/v1/trajectories/slice", OF_A_TRAJECTORY | {"start": 0.0, "end": 1.0}, "/trajectory"),
            ("/v1/trajectories/resample", OF_A_TRAJECTORY, "/trajectory"),
            ("/v1/trajectories/stop", OF_A_TRAJECTORY | {"time": 0.5}, "/trajectory"),
        )
    ),
    Bad(
        "polynomials beyond all bounds",
        VALIDATE,
        polynomials(coefficients=[[0.1, 0.0], [0.1, 1e20]]),
        INVALID,
        "/polynomials/0/coefficients/1",
    ),
    Bad(
        "joints with other breakpoints",
        VALIDATE,
        polynomials(other=[0.0, 1.5, 2.0]),
        INVALID,
        "/polynomials/1/breakpoints",
    ),
    Bad(
        "motion before of two joints",
        VALIDATE,
        validate_request(initial_velocity=[0.1, 0.1]),
        INVALID,
        "/initial_velocity",
    ),
    Bad("unknown robot to validate", VALIDATE, validate_request(robot="nobody"), "unknown_robot"),
    Bad("no positions", FORWARD, {"robot": "three_dof_arm", "positions": []}, INVALID, "/positions"),
    Bad(
        "ragged positions",
        FORWARD,
        {"robot": "three_dof_arm", "positions": [[0, 0, 0], [0, 0]]},
        INVALID,
        "/positions/1",
    ),
    Bad("no poses", INVERSE, {"robot": "three_dof_arm", "poses": []}, INVALID, "/poses"),
    Bad(
        "too many poses",
        INVERSE,
        {"robot": "three_dof_arm", "poses": [{"position": [0, 0, 0]}] * 2000},
        INVALID,
        "/poses",
    ),
    Bad(
        "all solutions",
        INVERSE,
        {"robot": "three_dof_arm", "poses": [{"position": [0, 0, 0]}], "solutions": "many"},
        INVALID,
        "/solutions",
    ),
    Bad(
        "short reference of the inverse",
        INVERSE,
        {"robot": "three_dof_arm", "poses": [{"position": [0.1, 0, 0]}], "reference": [0]},
        INVALID,
        "/reference",
    ),
    *(
        Bad(f"output of {value}", PLAN, setting(value), INVALID, "/actions/0/value")
        for value in ([], "high", {"on": True}, None)
    ),
    *BAD_KINEMATICS,
    *BAD_ROBOTS,
]
