"""The other planners of the benchmark of collisions, each used as its documentation shows it."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from itertools import combinations, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.collisions.models import Contacts, checked_pairs, shape_link, things_of, urdf_with_pieces
from planner.shapes import Box

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.scene import Scene
    from planner.spatial import FloatArray

LONGEST_SEGMENT = 0.005
"""Distance of OMPL's samples as a share of the extent of the joints' ranges, as MoveIt sets it."""

CONTROL_POINTS = 10
"""Control points of Drake's trajectory optimisation."""

CONTROLLED = 25
"""Places of the path at which Drake's optimisation keeps clear."""

CLEAR = 1e-3
"""The distance that it keeps there, m."""

SEED = 0
"""Seed of the random numbers of planners that take one."""

Search = Callable[["FloatArray", "FloatArray", float], "FloatArray | None"]
"""A start and a goal (joints,) and seconds to a path (N, joints), whose points straight motions join; None: none."""


@dataclass(frozen=True)
class Peer:
    """A library beside ours.

    Attributes:
        module: Where it is; the peer is left out where that cannot be imported.
        make: Its search for a robot in a scene.
    """

    module: str
    make: Callable[[Robot, Scene], Search]

    @property
    def installed(self) -> bool:
        """Whether it is there."""
        try:
            return find_spec(self.module) is not None
        except ModuleNotFoundError:
            return False


def _ompl(robot: Robot, scene: Scene) -> Search:
    from ompl import base, geometric, util

    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(SEED + 1)
    contacts = Contacts(robot, scene, true_meshes=False)
    space = base.RealVectorStateSpace(robot.dof)
    bounds = base.RealVectorBounds(robot.dof)
    for k, (low, high) in enumerate(zip(robot.limit("lower"), robot.limit("upper"), strict=True)):
        bounds.setLow(k, float(low))
        bounds.setHigh(k, float(high))
    space.setBounds(bounds)
    space.setLongestValidSegmentFraction(LONGEST_SEGMENT)

    def values(state: base.State) -> FloatArray:
        return np.array([state[k] for k in range(robot.dof)])

    def search(start: FloatArray, goal: FloatArray, seconds: float) -> FloatArray | None:
        setup = geometric.SimpleSetup(space)
        setup.setStateValidityChecker(lambda state: not contacts.touches(values(state)))
        ends = [space.allocState() for _ in range(2)]
        for state, position in zip(ends, (start, goal), strict=True):
            for k, value in enumerate(position.tolist()):
                state[k] = value
        setup.setStartAndGoalStates(*ends)
        setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
        if not setup.solve(seconds) or not setup.haveExactSolutionPath():
            return None
        setup.simplifySolution()
        return np.array([values(state) for state in setup.getSolutionPath().getStates()])

    return search


def _roboplan(robot: Robot, scene: Scene) -> Search:
    from roboplan import core, rrt

    folder = _folder()
    built = core.Scene(robot.id, core.loadUrdfSceneDescriptionFromXml(urdf_with_pieces(robot, folder)))
    links = {shape.link: shape.joint for shape in robot.collision_shapes}
    checked = checked_pairs(robot)
    for first, second in combinations(links, 2):
        if frozenset((first, second)) not in checked:
            built.setCollisions(shape_link(first), shape_link(second), False)
    color = np.full(4, 0.5)
    things: list[str] = []
    for name, shape, position in things_of(scene):
        placement = np.asfortranarray(np.eye(4))
        placement[:3, 3] = position
        key = f"{name}_{len(things)}"
        if isinstance(shape, Box):
            built.addBoxGeometry(key, "universe", core.Box(*shape.size), placement, color)
        else:
            built.addCylinderGeometry(key, "universe", core.Cylinder(shape.radius, shape.length), placement, color)
        for link, joint in links.items():
            if not joint:
                built.setCollisions(shape_link(link), key, False)
        for other in things:
            built.setCollisions(other, key, False)
        things.append(key)

    def search(start: FloatArray, goal: FloatArray, seconds: float) -> FloatArray | None:
        ends = []
        for position in (start, goal):
            end = core.JointConfiguration()
            end.joint_names, end.positions = built.getJointNames(), position
            ends.append(end)
        planner = rrt.RRT(built, rrt.RRTOptions(max_nodes=1_000_000, max_planning_time=seconds, rrt_connect=True))
        planner.setRngSeed(SEED)
        found = planner.plan(*ends)
        if found is None:
            return None
        short = core.PathShortcutter(built, core.PathShortcuttingOptions(seed=SEED)).shortcut(found)
        return np.array(short.positions)

    return search


def _drake(robot: Robot, scene: Scene) -> Search:
    from pydrake.geometry import Box as DrakeBox
    from pydrake.geometry import Cylinder as DrakeCylinder
    from pydrake.math import RigidTransform
    from pydrake.multibody.inverse_kinematics import MinimumDistanceLowerBoundConstraint
    from pydrake.multibody.plant import CoulombFriction
    from pydrake.planning import KinematicTrajectoryOptimization, RobotDiagramBuilder, SceneGraphCollisionChecker
    from pydrake.solvers import SnoptSolver, SolverOptions

    builder = RobotDiagramBuilder(0.0)
    plant = builder.plant()
    robots = builder.parser().AddModelsFromString(urdf_with_pieces(robot, _folder()), "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("link_0"))
    for number, (name, shape, position) in enumerate(things_of(scene)):
        solid = DrakeBox(*shape.size) if isinstance(shape, Box) else DrakeCylinder(shape.radius, shape.length)
        friction, key = CoulombFriction(), f"{name}_{number}"
        plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(position), solid, key, friction)
    plant.Finalize()
    checker = SceneGraphCollisionChecker(
        model=builder.Build(),
        robot_model_instances=robots,
        edge_step_size=0.05,
        configuration_distance_function=lambda a, b: float(np.linalg.norm(a - b)),
    )
    checked = checked_pairs(robot)
    for first, second in combinations({shape.link for shape in robot.collision_shapes}, 2):
        if frozenset((first, second)) not in checked:
            bodies = (plant.GetBodyByName(shape_link(link)) for link in (first, second))
            checker.SetCollisionFilteredBetween(*bodies, True)
    kept = MinimumDistanceLowerBoundConstraint(checker, CLEAR, checker.MakeStandaloneModelContext(), None, 0.05)
    options = SolverOptions()
    options.SetOption(SnoptSolver.id(), "Major iterations limit", 50)

    def attempt(start: FloatArray, goal: FloatArray, via: FloatArray) -> FloatArray | None:
        problem = KinematicTrajectoryOptimization(robot.dof, CONTROL_POINTS)
        problem.AddPathLengthCost()
        problem.AddPositionBounds(robot.limit("lower"), robot.limit("upper"))
        problem.AddDurationConstraint(1.0, 1.0)
        problem.AddPathPositionConstraint(start, start, 0.0)
        problem.AddPathPositionConstraint(goal, goal, 1.0)
        shares = np.linspace(0.0, 1.0, CONTROL_POINTS)
        guess = start[:, None] + (goal - start)[:, None] * shares + via[:, None] * 4.0 * shares * (1.0 - shares)
        problem.get_mutable_prog().SetInitialGuess(problem.control_points(), guess)
        for share in np.linspace(0.0, 1.0, CONTROLLED)[1:-1]:
            problem.AddPathPositionConstraint(kept, float(share))
        result = SnoptSolver().Solve(problem.prog(), None, options)
        if not result.is_success():
            return None
        path = problem.ReconstructTrajectory(result).vector_values(np.linspace(0.0, 1.0, 20 * CONTROLLED)).T
        are_free = (checker.CheckEdgeCollisionFree(*ends) for ends in pairwise(path))
        return path if all(are_free) else None

    def search(start: FloatArray, goal: FloatArray, seconds: float) -> FloatArray | None:
        rng = np.random.default_rng(SEED)
        end, via = time.monotonic() + seconds, np.zeros(robot.dof)
        while time.monotonic() < end:
            path = attempt(start, goal, via)
            if path is not None:
                return path
            via = rng.normal(size=robot.dof) * 0.5
        return None

    return search


@cache
def _folder() -> Path:
    """Return a folder for the files of this process, gone when it ends."""
    return Path(_kept.name)


_kept = tempfile.TemporaryDirectory(prefix="planner-pieces-")

PEERS = {
    "OMPL, RRT-Connect": Peer("ompl", _ompl),
    "roboplan, RRT-Connect": Peer("roboplan.rrt", _roboplan),
    "Drake, optimisation": Peer("pydrake", _drake),
}
"""By name. All of them have the convex pieces that this library uses."""
