"""Reads MJCF, compiled by MuJoCo, as a URDF document.

MuJoCo resolves the defaults, includes, frames and units of MJCF. The compiled model has each body's pose in its parent,
inertia, joints and shapes; these become links, joints and collision elements. A body with several joints becomes a
chain of links.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pinocchio as pin

from planner.robots.files.documents import RobotFiles, invalid_file
from planner.robots.files.urdf_writer import add_drive, add_inertial, add_joint, add_origin, text_of
from planner.spatial import FloatArray

ROOT_LINK = "world"
"""The link that MuJoCo's world becomes."""

KEYFRAME_GROUP = "all_joints"
"""The group of the SRDF that keyframes are states of."""


def read_mjcf(path: Path) -> RobotFiles:
    """Read an MJCF file: the tree of its bodies, without the shapes of the world.

    MJCF has no velocity limits. Joints (`actuatorfrcrange`) and their actuators have force limits; the least one
    counts. Excluded contacts become disabled collisions, and keyframes become named positions.

    Raises:
        OSError: The file cannot be read.
        InvalidRobotModel: MuJoCo is not installed, refuses the file, or a joint is a ball joint or a free one.
    """
    try:
        import mujoco
    except ModuleNotFoundError:
        message = f"{path.name} is an MJCF file; install `mujoco-core`, or the extra `models`"
        raise invalid_file("missing_package", message) from None
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise invalid_file("mjcf_failed", f"MuJoCo cannot compile {path.name}: {error}") from error
    return _Converter(mujoco, model, path.stem).files()


class _Converter:
    """Writes a compiled model as URDF and SRDF."""

    def __init__(self, mujoco: Any, model: Any, name: str) -> None:
        self.mujoco, self.model = mujoco, model
        self.urdf, self.srdf = Element("robot", name=name), Element("robot", name=name)
        self.meshes: dict[str, bytes] = {}
        self.links = [ROOT_LINK, *(self.name("body", body) for body in range(1, model.nbody))]

    def files(self) -> RobotFiles:
        """Write all bodies, sites, excluded contacts and keyframes."""
        SubElement(self.urdf, "link", name=ROOT_LINK)
        for body in range(1, self.model.nbody):
            self.body(body)
        for site in range(self.model.nsite):
            self.site(site)
        for pair in self.model.exclude_signature.tolist():
            first, second = (self.links[number] for number in divmod(pair, 1 << 16))
            SubElement(self.srdf, "disable_collisions", link1=first, link2=second, reason="Excluded in the MJCF")
        self.keyframes()
        srdf = tostring(self.srdf, encoding="unicode") if len(self.srdf) else None
        return RobotFiles(tostring(self.urdf, encoding="unicode"), srdf, self.meshes)

    def name(self, kind: str, number: int) -> str:
        """Return the name of a body, joint, site or mesh, or its kind and number where it has none."""
        kinds = self.mujoco.mjtObj
        named = {
            "body": kinds.mjOBJ_BODY,
            "joint": kinds.mjOBJ_JOINT,
            "site": kinds.mjOBJ_SITE,
            "mesh": kinds.mjOBJ_MESH,
        }
        return self.mujoco.mj_id2name(self.model, named[kind], number) or f"{kind}_{number}"

    def body(self, body: int) -> None:
        """Write a body with its joints; the frame of its link is the body's own."""
        model, link = self.model, self.links[body]
        joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        placement, parent = _pose(model.body_pos[body], model.body_quat[body]), self.links[model.body_parentid[body]]
        for joint in joints:
            anchor = _at(model.jnt_pos[joint])
            is_last = joint == joints[-1] and not anchor.translation.any()
            child = link if is_last else f"{link}_{self.name('joint', joint)}"
            self.joint(joint, parent, child, placement * anchor)
            if not is_last:
                SubElement(self.urdf, "link", name=child)
            parent, placement = child, anchor.inverse()
        if parent != link:
            add_joint(self.urdf, f"{link}_fixed", "fixed", (parent, link), placement)
        written = SubElement(self.urdf, "link", name=link)
        if model.body_mass[body] > 0.0:
            pose = _pose(model.body_ipos[body], model.body_iquat[body])
            add_inertial(written, model.body_mass[body], pose, np.diag(model.body_inertia[body]))
        for geom in range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body]):
            self.collision(written, geom)

    def joint(self, joint: int, parent: str, child: str, placement: pin.SE3) -> None:
        """Write a hinge or a slide; its position is MuJoCo's, whose bodies are where they are drawn at `ref`."""
        model, kinds = self.model, self.mujoco.mjtJoint
        name, kind = self.name("joint", joint), kinds(int(model.jnt_type[joint]))
        if kind not in (kinds.mjJNT_HINGE, kinds.mjJNT_SLIDE):
            called = "ball" if kind == kinds.mjJNT_BALL else "free"
            message = f"{name} is a {called} joint; an arm has hinges and slides on a base that does not move"
            raise invalid_file("unsupported_joint_kind", message)
        axis, reference = model.jnt_axis[joint], float(model.qpos0[model.jnt_qposadr[joint]])
        is_hinge, is_limited = kind == kinds.mjJNT_HINGE, bool(model.jnt_limited[joint])
        back = pin.SE3(pin.exp3(-reference * axis), np.zeros(3)) if is_hinge else _at(-reference * axis)
        urdf_kind = ("revolute" if is_limited else "continuous") if is_hinge else "prismatic"
        element = add_joint(self.urdf, name, urdf_kind, (parent, child), placement * back, axis)
        limit = SubElement(element, "limit")
        if is_limited:
            lower, upper = model.jnt_range[joint]
            limit.attrib |= {"lower": text_of(lower), "upper": text_of(upper)}
        effort = self.effort(joint)
        if np.isfinite(effort):
            limit.set("effort", text_of(effort))
        address = model.jnt_dofadr[joint]
        drive = (model.dof_frictionloss[address], np.ravel(model.dof_damping[address])[0], model.dof_armature[address])
        add_drive(self.urdf, element, *map(float, drive))
        self.mimic(element, joint)

    def effort(self, joint: int) -> float:
        """Return the least force limit of a joint and of the actuators on it, N m or N; infinite: none."""
        model = self.model
        efforts = [np.abs(model.jnt_actfrcrange[joint]).min()] if model.jnt_actfrclimited[joint] else []
        for actuator in range(model.nu):
            on_joint = model.actuator_trntype[actuator] == int(self.mujoco.mjtTrn.mjTRN_JOINT)
            if on_joint and model.actuator_trnid[actuator, 0] == joint and model.actuator_forcelimited[actuator]:
                gear = abs(model.actuator_gear[actuator, 0])
                efforts.append(gear * np.abs(model.actuator_forcerange[actuator]).min())
        return float(min(efforts, default=np.inf))

    def mimic(self, element: Element, joint: int) -> None:
        """Write the equality that makes a joint follow another one, if it is linear."""
        model = self.model
        for number in range(model.neq):
            follows = model.eq_type[number] == int(self.mujoco.mjtEq.mjEQ_JOINT) and model.eq_obj1id[number] == joint
            leader = model.eq_obj2id[number]
            if follows and leader >= 0 and not model.eq_data[number, 2:5].any():
                offset, multiplier = model.eq_data[number, :2]
                own, other = (float(model.qpos0[model.jnt_qposadr[each]]) for each in (joint, leader))
                element.append(
                    element.makeelement(
                        "mimic",
                        {
                            "joint": self.name("joint", leader),
                            "multiplier": text_of(multiplier),
                            "offset": text_of(own + offset - multiplier * other),
                        },
                    )
                )

    def site(self, site: int) -> None:
        """Write a site of a body as a link without mass: a frame that poses may be about."""
        body, name = self.model.site_bodyid[site], self.name("site", site)
        if not body:
            return
        link = name if name not in self.links else f"{name}_site"
        SubElement(self.urdf, "link", name=link)
        placement = _pose(self.model.site_pos[site], self.model.site_quat[site])
        add_joint(self.urdf, f"{link}_fixed", "fixed", (self.links[body], link), placement)

    def collision(self, link: Element, geom: int) -> None:
        """Write a geom that can touch others; an ellipsoid becomes the box around it."""
        model, kinds = self.model, self.mujoco.mjtGeom
        if not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            return
        size, kind = model.geom_size[geom], kinds(int(model.geom_type[geom]))
        round_shape = {"radius": text_of(size[0]), "length": text_of(2.0 * size[1])}
        shapes = {
            kinds.mjGEOM_SPHERE: ("sphere", {"radius": text_of(size[0])}),
            kinds.mjGEOM_CAPSULE: ("capsule", round_shape),
            kinds.mjGEOM_CYLINDER: ("cylinder", round_shape),
            kinds.mjGEOM_ELLIPSOID: ("box", {"size": text_of(*(2.0 * size))}),
            kinds.mjGEOM_BOX: ("box", {"size": text_of(*(2.0 * size))}),
        }
        if kind == kinds.mjGEOM_MESH:
            tag, attributes = "mesh", {"filename": self.mesh(model.geom_dataid[geom])}
        elif kind in shapes:
            tag, attributes = shapes[kind]
        else:
            return  # planes and height fields are of the world
        collision = SubElement(link, "collision")
        add_origin(collision, _pose(model.geom_pos[geom], model.geom_quat[geom]))
        SubElement(SubElement(collision, "geometry"), tag, attributes)

    def mesh(self, mesh: int) -> str:
        """Keep a mesh as OBJ, and return its name."""
        model, name = self.model, f"{self.name('mesh', mesh)}.obj"
        if name not in self.meshes:
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
            lines = [f"v {text_of(*corner)}" for corner in model.mesh_vert[first : first + count].astype(float)]
            lines += ["f {} {} {}".format(*(1 + corners)) for corners in model.mesh_face[face : face + faces]]
            self.meshes[name] = "\n".join(lines).encode()
        return name

    def keyframes(self) -> None:
        """Write named keyframes as states of a group of all joints."""
        model, kind = self.model, self.mujoco.mjtObj.mjOBJ_KEY
        names = [self.mujoco.mj_id2name(model, kind, key) for key in range(model.nkey)]
        if not any(names):
            return
        group = SubElement(self.srdf, "group", name=KEYFRAME_GROUP)
        joints = [(self.name("joint", joint), model.jnt_qposadr[joint]) for joint in range(model.njnt)]
        for joint, _ in joints:
            SubElement(group, "joint", name=joint)
        for key, name in enumerate(names):
            if name:
                state = SubElement(self.srdf, "group_state", name=name, group=KEYFRAME_GROUP)
                for joint, address in joints:
                    SubElement(state, "joint", name=joint, value=text_of(model.key_qpos[key, address]))


def _pose(position: FloatArray, quaternion: FloatArray) -> pin.SE3:
    """Return a pose; the quaternion is (w, x, y, z)."""
    w, x, y, z = quaternion
    return pin.SE3(pin.Quaternion(w, x, y, z).normalized().matrix(), np.array(position))


def _at(position: FloatArray) -> pin.SE3:
    return pin.SE3(np.eye(3), np.array(position))
