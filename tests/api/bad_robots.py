"""The part of the table of bad requests that is about robot models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tests.api.requests import dh_joint, dh_robot, urdf_chain, urdf_joint, urdf_robot


@dataclass(frozen=True)
class Bad:
    """A bad request; `pointer` None: there is none to expect."""

    name: str
    path: str
    body: Any
    code: str
    pointer: str | None = None


ROBOTS = "/v1/robots"
INVALID, MODEL = "invalid_request", "invalid_robot_model"
ENTITIES = '<!DOCTYPE r [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>'
EXTERNAL = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>'

BAD_ROBOTS = [
    # Denavit-Hartenberg tables.
    Bad("unknown convention", ROBOTS, dh_robot(convention="hayati"), INVALID, "/convention"),
    Bad("no rows", ROBOTS, dh_robot(joints=[]), INVALID, "/joints"),
    Bad("hundreds of rows", ROBOTS, dh_robot(joints=[dh_joint()] * 200), INVALID, "/joints"),
    Bad(
        "row without alpha",
        ROBOTS,
        dh_robot(joints=[{"kind": "revolute", "theta": 0, "d": 0, "a": 1}]),
        INVALID,
        "/joints/0/alpha",
    ),
    Bad("helical joint", ROBOTS, dh_robot(joints=[dh_joint(kind="helical")]), INVALID, "/joints/0/kind"),
    Bad("negative velocity", ROBOTS, dh_robot(joints=[dh_joint(velocity=-1)]), INVALID, "/joints/0/velocity"),
    Bad("id with a slash", ROBOTS, dh_robot(id="a/b"), INVALID, "/id"),
    Bad("lower above upper", ROBOTS, dh_robot(joints=[dh_joint(lower=1.0, upper=-1.0)]), MODEL),
    Bad("id of the catalogue", ROBOTS, dh_robot(id="three_dof_arm"), "catalogue_robot"),
    # URDF documents.
    Bad("not xml", ROBOTS, {"kind": "urdf", "id": "uploaded", "urdf": "robot"}, MODEL),
    Bad("empty urdf", ROBOTS, {"kind": "urdf", "id": "uploaded", "urdf": ""}, INVALID, "/urdf"),
    Bad("another root", ROBOTS, {"kind": "urdf", "id": "uploaded", "urdf": "<svg/>"}, MODEL),
    Bad("no links", ROBOTS, urdf_robot(""), MODEL),
    Bad("thousands of links", ROBOTS, urdf_robot(urdf_chain(3000)), MODEL),
    Bad(
        "doctype with nested entities",
        ROBOTS,
        {"kind": "urdf", "id": "uploaded", "urdf": ENTITIES + '<robot name="&c;"><link name="a"/></robot>'},
        MODEL,
    ),
    Bad(
        "external entity",
        ROBOTS,
        {"kind": "urdf", "id": "uploaded", "urdf": EXTERNAL + '<robot name="r"><link name="&x;"/></robot>'},
        MODEL,
    ),
    Bad("deeply nested elements", ROBOTS, urdf_robot("<a>" * 50_000 + "</a>" * 50_000), MODEL),
    Bad(
        "cycle",
        ROBOTS,
        urdf_robot('<link name="a"/><link name="b"/>' + urdf_joint(0, "a", "b") + urdf_joint(1, "b", "a")),
        MODEL,
    ),
    Bad(
        "two roots",
        ROBOTS,
        urdf_robot('<link name="a"/><link name="b"/><link name="c"/>' + urdf_joint(0, "a", "b")),
        MODEL,
    ),
    Bad("link that is not there", ROBOTS, urdf_robot('<link name="a"/>' + urdf_joint(0, "a", "b")), MODEL),
    Bad(
        "negative mass",
        ROBOTS,
        urdf_robot(
            '<link name="a"/><link name="b"><inertial><mass value="-1"/>'
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>' + urdf_joint(0, "a", "b")
        ),
        MODEL,
    ),
    Bad(
        "mass that is not a number",
        ROBOTS,
        urdf_robot(
            '<link name="a"/><link name="b"><inertial><mass value="nan"/>'
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>' + urdf_joint(0, "a", "b")
        ),
        MODEL,
    ),
    Bad("zero axis", ROBOTS, urdf_robot(urdf_chain(1).replace('xyz="0 1 0"', 'xyz="0 0 0"')), MODEL),
    Bad(
        "limits the wrong way round",
        ROBOTS,
        urdf_robot('<link name="a"/><link name="b"/>' + urdf_joint(0, "a", "b", lower=1, upper=-1)),
        MODEL,
    ),
    Bad("tip that is not there", ROBOTS, urdf_robot(urdf_chain(2), tip_frame="nowhere"), MODEL),
]
