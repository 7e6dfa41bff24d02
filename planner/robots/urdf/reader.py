"""Reads a robot from URDF. The document comes from a client: nothing in it is trusted, nothing it names is opened.

Only the tree of links and joints, the masses and the visual elements are read. The model is built here, so
that no foreign XML ever reaches Pinocchio's own parser.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence

import numpy as np
import pinocchio as pin

from planner.robots.build import Body, Link, MovingJoint, build_model
from planner.robots.chain_checks import check_chain
from planner.robots.checks import (
    MAX_JOINTS,
    MAX_LINKS,
    check_limits,
    check_names,
    check_position_limits,
    held_joints,
    with_checked_drives,
)
from planner.robots.collision.geometry import CollisionGeometry
from planner.robots.collision.mesh_files import FindFile, FindPieces, no_meshes
from planner.robots.description import Joint, RobotDescription
from planner.robots.findings import Findings, shown
from planner.robots.urdf.arm import ArmFinder, PlanningGroup, WholeConfiguration
from planner.robots.urdf.elements import UrdfJoint, UrdfReader, rotor_inertias
from planner.robots.urdf.srdf import named_positions, read_srdf
from planner.robots.urdf.xml_document import parse_robot_document
from planner.robots.visuals import VisualGeometry
from planner.spatial import rotation_with_z_along


def read_urdf(
    urdf: str,
    *,
    id: str,
    requested: PlanningGroup,
    srdf: str | None = None,
    meshes: FindPieces = no_meshes,
    files: FindFile = no_meshes,
    source: str = "uploaded URDF",
) -> RobotDescription:
    """Read the arm from the root link to the tip; all other joints are locked.

    Acceleration and jerk limits, which documents before URDF 1.2 do not have, come from the default rule of
    `planner.robots.checks`.

    Args:
        urdf: The document.
        id: Identifier of the robot.
        requested: The moving joints and the end of the arm. By default, the SRDF's only chain, or else the chain with
            the most joints, without fingers at its end.
        srdf: A document with groups, their states and disabled collision pairs.
        meshes: Function that finds the collision meshes, at the first use of the shapes.
        files: Function that finds the files of the visual meshes, at the first use of these.
        source: Where the document comes from.

    Raises:
        InvalidRobotModel: The model cannot be used; `findings` lists everything that was found.
    """
    findings = Findings()
    document = parse_robot_document(urdf, "URDF", findings)
    link_elements, joint_elements = document.findall("link"), document.findall("joint")
    if len(link_elements) > MAX_LINKS or len(joint_elements) > MAX_LINKS:
        findings.error("too_many_links", None, f"more than {MAX_LINKS} links or joints")
    if not link_elements:
        findings.error("no_links", None, "the URDF has no link")
    findings.raise_errors()
    reader = UrdfReader(findings, rotor_inertias(document))
    bodies = {element.get("name", ""): reader.body(element) for element in link_elements}
    joints = [reader.joint(element) for element in joint_elements]
    check_names("link", [element.get("name", "") for element in link_elements], findings)
    check_names("joint", [joint.name for joint in joints], findings)
    reader.read_colours(document)
    geometry = [shape for element in link_elements for shape in reader.geometry(element)]
    collisions = tuple(shape for element in link_elements for shape in reader.collisions(element))
    reader.report_left_out()
    _check_tree(bodies, joints, findings)

    root, arrivals = _walk(bodies, joints)
    groups, states, pairs = read_srdf(srdf, document.get("name", ""), root, arrivals, findings)
    findings.raise_errors()
    finder = ArmFinder(root, arrivals, groups, findings)
    tip, chain = finder.find(requested)
    fixed = held_joints((joint.moving for joint in chain if joint.moving is not None), findings)
    chain = [joint for joint in chain if joint.name not in fixed]
    limits = {joint.name: _limits(joint.moving, findings) for joint in chain if joint.moving is not None}
    if len(chain) > MAX_JOINTS:
        findings.error("too_many_joints", None, f"the arm has {len(chain)} joints, more than {MAX_JOINTS}")
    elif not chain:
        findings.error("no_joints", None, f"no joint moves {shown(tip)}")
    findings.raise_errors()
    limits = {joint.name: joint for joint in with_checked_drives(limits.values(), findings)}

    on_the_way = {joint.name for joint in finder.path(tip)}
    configuration = WholeConfiguration(arrivals, limits, findings)
    held = configuration.positions({**requested.locked, **fixed}, on_the_way)
    findings.raise_errors()
    model = _build(id, root, tip, arrivals, bodies, limits, held, findings)
    return RobotDescription(
        id,
        source,
        model,
        tuple(limits.values()),
        tip,
        geometry=tuple(geometry),
        named_positions=named_positions(states, tuple(limits.values()), requested.group, findings),
        groups=groups,
        disabled_collisions=pairs,
        collision=CollisionGeometry(
            model,
            tip,
            [joint.travel for joint in limits.values()],
            collisions,
            frozenset(reader.unread),
            meshes=meshes,
        ),
        visuals=VisualGeometry(tuple(reader.visuals), files) if reader.visuals else None,
        followers=tuple(configuration.followers()),
        findings=tuple(findings.items),
    )


def _check_tree(links: Collection[str], joints: Sequence[UrdfJoint], findings: Findings) -> None:
    """Check that links and joints form one tree: known links, one root, one parent for each link.

    Raises:
        InvalidRobotModel: They do not, or something before was wrong already.
    """
    for joint in joints:
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                subject = shown(joint.name)
                findings.error("unknown_link", subject, f"the {end} of {subject} is not a link: {shown(link)!r}")
    for link, count in Counter(joint.child for joint in joints).items():
        if count > 1:
            findings.error("several_parents", shown(link), f"{shown(link)} is the child of {count} joints")
    findings.raise_errors()
    children = {joint.child for joint in joints}
    roots = [link for link in links if link not in children]
    if len(roots) > 1:
        listed = ", ".join(shown(root) for root in roots[:10])
        findings.error("several_roots", None, f"the links do not hang together; without a parent are {listed}")
    elif not roots or len(_walk(links, joints)[1]) + 1 < len(links):
        findings.error("cycle", None, "the joints form a cycle")
    findings.raise_errors()


def _walk(links: Collection[str], joints: Sequence[UrdfJoint]) -> tuple[str, dict[str, UrdfJoint]]:
    """Return the root link, and for every link that hangs on it the joint that leads there, parents first."""
    children = {joint.child for joint in joints}
    root = next(link for link in links if link not in children)
    leaving: dict[str, list[UrdfJoint]] = {}
    for joint in joints:
        leaving.setdefault(joint.parent, []).append(joint)
    arrivals: dict[str, UrdfJoint] = {}
    waiting = [root]
    while waiting:
        for joint in leaving.get(waiting.pop(0), ()):
            if joint.child not in arrivals:
                arrivals[joint.child] = joint
                waiting.append(joint.child)
    return root, arrivals


def _limits(joint: Joint, findings: Findings) -> Joint:
    """Check the limits of a joint; URDF requires position limits."""
    if joint.kind != "continuous" and math.isinf(joint.lower):
        name = shown(joint.name)
        text = f"{name} has no position limits: give lower and upper, or make it a continuous joint"
        findings.error("missing_position_limit", name, text)
    return check_limits(check_position_limits(joint, findings), findings)


def _build(
    name: str,
    root: str,
    tip: str,
    arrivals: Mapping[str, UrdfJoint],
    bodies: Mapping[str, Body | None],
    limits: Mapping[str, Joint],
    held: Mapping[str, float],
    findings: Findings,
) -> pin.Model:
    """Build the model with the joints in `limits` as degrees of freedom; lock joints at `held`, rad or m."""
    base = [Link(root, pin.SE3.Identity(), bodies[root])]
    moving: dict[str, MovingJoint] = {}
    links = {root: base}  # of each link, the list of links that move with it
    placements = {root: pin.SE3.Identity()}  # of each link, in the frame of the joint that carries it
    for link, joint in arrivals.items():
        if joint.name in limits:
            turned = pin.SE3(rotation_with_z_along(joint.axis), np.zeros(3))
            links[link] = []
            placement = placements[joint.parent] * joint.placement * turned
            moving[joint.name] = MovingJoint(limits[joint.name], placement, links[link])
            placements[link] = turned.inverse()
        else:
            placements[link] = placements[joint.parent] * joint.placement_at(held.get(joint.name, 0.0))
            links[link] = links[joint.parent]
        links[link].append(Link(link, placements[link], bodies[link]))
    chain = [moving[joint] for joint in limits]
    check_chain(chain, tip, findings)
    return build_model(name, base, chain)
