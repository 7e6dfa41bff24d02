"""Roadmaps: proved collision-free joint positions and motions that stay with a robot in a scene."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from planner.errors import InvalidProblem
from planner.spatial import FloatArray

MOST_ROADMAP_SAMPLES = 2000
"""Largest number of samples of a roadmap: its bytes, and the time of building it, are bounded by them."""

MOST_ROADMAP_POSITIONS = 32
"""Largest number of joint positions that the user of a roadmap gives."""

HEADER_BYTES = 8
"""Number of bytes with the length of the header of a roadmap's bytes."""


@dataclass(frozen=True, eq=False)
class Roadmap:
    """Collision-free joint positions of a robot in a scene, and proved straight motions between them.

    Attributes:
        positions: (nodes, joints), rad or m: the collision-free ones of the given joint positions and the samples.
        edges: (edges, 2): the nodes of each proved motion, the lower number first.
        samples: Number of samples drawn, free or not.
        given: (given, joints), rad or m: the joint positions that the user gave, free or not.
        ways: Nodes of the short paths between given positions, one tuple for each path.
        robot: Digest of the moving bodies: kinematics, shapes, attached objects, pairs checked against each other.
        objects: Digest of each static object with its margins, by its name.
        checked: Number of joint positions and motions that the build checked; its bytes do not have it.

    Examples:
        >>> import planner
        >>> wall = planner.SceneObject("wall", [planner.Box([0.8, 0.1, 1.6])], planner.Pose([1.3, 0.0, 0.8]))
        >>> roadmap = planner.build_roadmap(planner.load_robot("kuka_kr16_2"), planner.Scene([wall]), samples=20)
        >>> planner.Roadmap.from_bytes(roadmap.to_bytes()).samples
        20
    """

    positions: FloatArray
    edges: np.ndarray
    samples: int
    given: FloatArray
    ways: tuple[tuple[int, ...], ...]
    robot: str
    objects: Mapping[str, str]
    checked: int = 0

    def __post_init__(self) -> None:
        """Copy the arrays, and make them read-only."""
        for name in ("positions", "edges", "given"):
            array = np.array(getattr(self, name))
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def to_bytes(self) -> bytes:
        """Write the roadmap as bytes, equal ones for equal roadmaps."""
        header = {
            "nodes": len(self.positions),
            "edges": len(self.edges),
            "given": len(self.given),
            "joints": self.positions.shape[1],
            "ways": self.ways,
            "samples": self.samples,
            "robot": self.robot,
            "objects": dict(sorted(self.objects.items())),
        }
        text = json.dumps(header, separators=(",", ":")).encode()
        arrays = [self.positions.astype("<f8"), self.given.astype("<f8"), self.edges.astype("<i4")]
        return b"".join([len(text).to_bytes(HEADER_BYTES, "little"), text, *(array.tobytes() for array in arrays)])

    @classmethod
    def from_bytes(cls, content: bytes) -> Roadmap:
        """Read a roadmap from its bytes.

        Raises:
            InvalidProblem: They are no roadmap.
        """
        try:
            begin = HEADER_BYTES + int.from_bytes(content[:HEADER_BYTES], "little")
            header = json.loads(content[HEADER_BYTES:begin])
            joints, nodes, edges, given = (header[name] for name in ("joints", "nodes", "edges", "given"))
            rows = np.frombuffer(content, "<f8", (nodes + given) * joints, begin).reshape(-1, joints)
            pairs = np.frombuffer(content, "<i4", 2 * edges, begin + rows.nbytes).reshape(-1, 2)
            is_whole = begin + rows.nbytes + pairs.nbytes == len(content) and np.isfinite(rows).all()
            if not is_whole or (edges and not 0 <= pairs.min() <= pairs.max() < nodes):
                raise ValueError("the arrays have other sizes, or no numbers")
            ways = tuple(tuple(map(int, way)) for way in header["ways"])
            if any(not 0 <= node < nodes for way in ways for node in way):
                raise ValueError("a path has unknown nodes")
            samples, robot, objects = header["samples"], header["robot"], header["objects"]
        except (ValueError, KeyError, TypeError, OverflowError) as error:
            message = f"must be the bytes of a roadmap, as `to_bytes` writes them; {error}"
            raise InvalidProblem([(("roadmap",), message)]) from None
        return cls(rows[:nodes], pairs.astype(int), samples, rows[nodes:], ways, robot, objects)
