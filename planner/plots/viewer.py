"""The robot of a plan moves in its scene, shown in a browser by the package viser."""

from __future__ import annotations

import math
from collections.abc import Collection
from contextlib import redirect_stdout
from io import StringIO
from threading import Event, Lock, Thread
from time import monotonic
from typing import Any

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.plots.quantities import Planned, drawn_times, kept_limits, samples_for, stops_of
from planner.plots.space.surroundings import CARRIED, PLANE, STANDING, Style, shown_points, standing_things
from planner.plots.view import VIEWS, drawn_tool_poses, joined_names, stick_model
from planner.robots.derived.standing import foot_at_zero, placement_in_world
from planner.robots.visuals import Colour
from planner.scene import HERE, CollisionChecker, SceneObject
from planner.scene.bodies import Bodies, JointTree
from planner.shapes import Shape, surface
from planner.spatial import FloatArray, quaternion

PICTURES_PER_SECOND = 30.0
"""The rate at which joints move while the trajectory plays."""

TIME_STEP = 1e-3
"""The step of the time slider, s; of a robot that rests the whole range."""

CAMERA_DISTANCE = 0.9
"""Distance of the camera from the middle of the picture, as a share of its diagonal."""

MARK_SHARE = 0.008
"""Radius of the waypoints, as a share of the diagonal of the picture."""

NAME_SHARE = 0.02
"""Distance up to which waypoints have their names on one label, as a share of the same diagonal."""

GRID_SHARE = 1.5
"""Size of the grid in the base plane, as a share of the same diagonal."""

POINT_SHARE = 0.003
"""Size of the points of a point cloud, and thickness of the path, as a share of the same diagonal."""

MODEL = Style("#A6ADB8", "#A6ADB8", 1.0)
"""The style of the shapes of links that are in the model of the robot."""

ESTIMATE = Style("#E9A75C", "#E9A75C", 1.0)
"""The style of the shapes of links that are an estimate."""

PATH_COLOUR = (31, 119, 180)
"""The colour of the path of the tool: red, green and blue from 0 to 255."""

GRID_COLOUR = (190, 190, 190)
"""The colour of every fifth line of the grid, likewise; its cells are 0.1 m wide."""

MARK_COLOUR = (34, 34, 34)
"""The colour of the waypoints, likewise."""


class Viewer:
    """A plan in a browser, shown by a server on this machine until it is closed; a context manager, too.

    Attributes:
        url: The address for a browser.

    Examples:
        >>> import planner
        >>> arm = planner.load_robot("three_dof_arm")
        >>> plan = planner.plan(planner.PlanningProblem(arm, [[0.0, 0.5, 0.5], [0.5, 1.0, 1.0]]))
        >>> viewer: planner.Viewer = plan.view()  # doctest: +SKIP
        >>> viewer.play()  # doctest: +SKIP
    """

    def __init__(self, plan: Planned, port: int) -> None:
        """Start the server at a port, or at the next free one.

        Raises:
            ModuleNotFoundError: viser is not installed (extra `view`).
        """
        try:
            import viser
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError('needs viser: pip install "trajectory-planner[view]"') from error
        self._plan, self._model = plan, plan.problem.robot.model
        self._bodies, self._is_shown = Bodies(JointTree.of(plan.problem.robot), ()), Lock()
        self._checkers = segment_checkers(plan.problem, plan.path.positions)
        with redirect_stdout(StringIO()):  # viser prints the address, which a caller may not want
            self._server: Any = viser.ViserServer("127.0.0.1", port, label=plan.problem.robot.id, verbose=False)
        self._server.gui.configure_theme(show_share_button=False, show_logo=False)  # sharing asks another machine
        self.url = f"http://127.0.0.1:{self._server.get_port()}"
        self._changing: list[tuple[Any, Collection[CollisionChecker]]] = []  # shapes with the checkers that have them
        self._joints = [self._scene.add_frame(f"joint_{k}", show_axes=False) for k in range(self._model.njoints)]
        self._moving: list[tuple[SceneObject, Any]] = []
        self._visuals: list[Any] = []
        self._solids: list[Any] = []  # the collision shapes of links that have visual meshes
        self._draw_links()
        self._draw_moving()
        diagonal = self._draw_surroundings()
        self._tool = self._scene.add_frame("tool", axes_length=0.06 * diagonal, axes_radius=0.004 * diagonal)
        self._plays, self._is_closed = Event(), Event()
        self._add_controls()
        self._show()
        self._player = Thread(target=self._play, daemon=True)
        self._player.start()

    @property
    def _scene(self) -> Any:
        return self._server.scene

    def show(self, time: float) -> None:
        """Show the robot and its attached objects at a time, s."""
        self._time.value = time

    def _show(self) -> None:
        """Move the drawings to the time of the slider; viser leaves out moves of a few micrometres."""
        trajectory, dynamics = self._plan.trajectory, self._plan.path.dynamics
        with self._is_shown, self._server.atomic():
            time = min(self._time.value, trajectory.duration)
            segments = trajectory.segments[trajectory.locate(np.array([time]))[0]]
            positions = trajectory.evaluate([time], (0,))[0]
            checker = self._checkers[min(int(segments[0]), len(self._checkers) - 1)]
            points, rotations = drawn_tool_poses(dynamics, segments, positions)
            turns, origins = self._bodies.frames(positions)
            for frame, turn, origin in zip(self._joints, turns[0], origins[0], strict=True):
                _put(frame, turn, origin)
            _put(self._tool, rotations[0], points[0])
            for thing, frame in self._moving:
                pose = thing.pose_at(time).to_frame(checker.base or HERE)
                _put(frame, np.eye(3) if pose.rotation is None else pose.rotation, pose.position)
            for handle, checkers in self._changing:
                handle.visible = checker in checkers

    def show_collision_shapes(self, shows: bool = True) -> None:
        """Show the shapes of which clearance is proved in place of visual meshes, or these; some robots have none."""
        self._solids_box.value = shows

    def play(self, plays: bool = True) -> None:
        """Let the trajectory play from the shown time on, at its end from the start; or stop it there."""
        if plays and self._time.value >= self._plan.trajectory.duration:
            self._time.value = 0.0
        self._button.label = "Pause" if plays else "Play"
        (self._plays.set if plays else self._plays.clear)()

    @property
    def is_playing(self) -> bool:
        """Whether the trajectory plays."""
        return self._plays.is_set()

    def wait(self) -> None:
        """Wait until the viewer is closed."""
        self._is_closed.wait()

    def close(self) -> None:
        """Stop the server; browsers show no more."""
        self._is_closed.set()
        self._player.join()
        self._server.stop()

    def __enter__(self) -> Viewer:
        """Return the viewer."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    def _repr_html_(self) -> str:
        """Return the viewer as a part of a notebook."""
        return f'<iframe src="{self.url}" width="100%" height="480" style="border: 0" title="plan"></iframe>'

    def _draw_links(self) -> None:
        """Draw the shapes of the links, and of the attached objects, below the frames of their joints."""
        robot = self._plan.problem.robot
        for number, drawn in enumerate(robot.visual_meshes):
            joint, placement = placement_in_world(robot, drawn.joint, drawn.placement)
            name = _path(f"joint_{joint}", f"visual_{number}")
            handle = self._mesh(name, *drawn.surface, MODEL if drawn.colour is None else _style(drawn.colour))
            _put(handle, placement.rotation, placement.translation)
            self._visuals.append(handle)
        covered = {drawn.link for drawn in robot.visual_meshes}
        for number, link in enumerate(robot.collision_shapes):
            style = MODEL if link.source == "model" else ESTIMATE
            joint, placement = placement_in_world(robot, link.joint, link.placement)
            name = _path(f"joint_{joint}", f"link_{number}")
            handle = self._mesh(name, *surface(link.shape), style)
            _put(handle, placement.rotation, placement.translation)
            if link.link in covered:
                self._solids.append(handle)
        for order, checker in enumerate(dict.fromkeys(self._checkers)):
            attached = {thing.id for thing in checker.scene.attached}
            for number, body in enumerate(checker.bodies.pieces):
                if body.name in attached:
                    handle = self._mesh(
                        _path(f"joint_{body.joint}", f"carried_{order}_{number}"), *surface(body.shape), CARRIED
                    )
                    _put(handle, body.rotation, body.translation)
                    self._changing.append((handle, {checker}))

    def _draw_moving(self) -> None:
        """Draw the moving objects, each below a frame of its own."""
        having: dict[SceneObject, set[CollisionChecker]] = {}
        for checker in self._checkers:
            for thing in checker.moving:
                having.setdefault(thing, set()).add(checker)
        for number, (thing, checkers) in enumerate(having.items()):
            frame = self._scene.add_frame(f"moving_{number}", show_axes=False)
            shapes = [shape for shape in thing.shapes if isinstance(shape, Shape)]
            for k, shape in enumerate(shapes):
                handle = self._mesh(_path(f"moving_{number}", f"shape_{k}"), *surface(shape), STANDING)
                self._changing.append((handle, checkers))
            self._moving.append((thing, frame))

    def _draw_surroundings(self) -> float:
        """Draw the path of the tool, its waypoints and the scene, and return the diagonal of the picture, m."""
        plan, stops = self._plan, stops_of(self._plan)
        samples = samples_for(plan, (), drawn_times(plan))
        path, _ = drawn_tool_poses(plan.path.dynamics, samples.segment, samples.position)
        rows = np.searchsorted(samples.time, [stop.arrival for stop in stops]).clip(0, len(path) - 1)
        robots = [plan.path.dynamics.robot_on(min(stop.row, len(plan.path.durations) - 1)) for stop in stops]
        sticks = [stick_model(robot, plan.path.positions[stop.row]) for robot, stop in zip(robots, stops, strict=True)]
        things = standing_things(self._checkers) if plan.problem.scene is not None else []
        points = shown_points([thing for thing, _ in things], np.concatenate([path, *sticks]))
        low, high = points.min(axis=0), points.max(axis=0)
        diagonal = float(np.linalg.norm(high - low))
        self._scene.add_line_segments(
            "path", np.stack([path[:-1], path[1:]], axis=1), PATH_COLOUR, thickness=POINT_SHARE * diagonal
        )
        for row, names in joined_names(path[rows], [stop.name for stop in stops], NAME_SHARE * diagonal):
            point = path[rows[row]]
            self._scene.add_icosphere(f"waypoint_{row}", MARK_SHARE * diagonal, MARK_COLOUR, position=point)
            self._scene.add_label(_path(f"waypoint_{row}", "name"), ", ".join(names))
        for number, (thing, checkers) in enumerate(things):
            if (part := thing.within(low, high) if thing.plane is not None else thing) is None:
                continue
            handles = [
                self._mesh(f"thing_{number}_{k}", piece.vertices, piece.faces, part.style)
                for k, piece in enumerate(part.pieces)
            ]
            if len(part.points):
                cloud = self._scene.add_point_cloud(
                    f"thing_{number}_points", part.points, _rgb(part.style.edge), point_size=POINT_SHARE * diagonal
                )
                handles.append(cloud)
            self._changing += [(handle, checkers) for handle in handles]
        size = GRID_SHARE * diagonal
        self._scene.add_grid("grid", size, size, cell_size=0.1, section_size=0.5, section_color=GRID_COLOUR)
        up = -foot_at_zero(plan.problem.robot).rotation.T @ self._model.gravity.linear
        middle, up = 0.5 * (low + high), up / np.linalg.norm(up)
        self._scene.set_up_direction(tuple(up))
        toward = VIEWS["isometric"].toward
        toward = toward - 2.0 * min(0.0, float(toward @ up)) * up  # from above, however the base is mounted
        self._server.initial_camera.position = middle + CAMERA_DISTANCE * diagonal * toward
        self._server.initial_camera.look_at = middle
        return diagonal

    def _mesh(self, name: str, vertices: FloatArray, faces: np.ndarray, style: Style) -> Any:
        return self._scene.add_mesh_simple(
            name,
            vertices.astype(np.float32),
            faces.astype(np.uint32),
            color=_rgb(style.fill),
            opacity=style.opacity if style == PLANE else None,  # the others are thinner on paper alone
            flat_shading=True,
            side="double",
        )

    def _add_controls(self) -> None:
        """Add the verdict, the time slider and the button that plays."""
        plan, duration, gui = self._plan, self._plan.trajectory.duration, self._server.gui
        gui.add_markdown(f"**{plan.problem.robot.id}**, {plan.backend.kind}, {duration:.4g} s: {kept_limits(plan)}")
        steps = max(1, math.ceil(duration / TIME_STEP))
        self._time = gui.add_slider("Time (s)", 0.0, round(steps * TIME_STEP, 3), TIME_STEP, 0.0)
        self._button = gui.add_button("Play")
        self._solids_box = gui.add_checkbox("Collision shapes", False, visible=bool(self._visuals))
        self._solids_box.on_update(lambda _: self._show_solids())
        self._show_solids()
        self._time.on_update(lambda _: self._show())
        self._button.on_click(lambda _: self.play(not self.is_playing))

    def _show_solids(self) -> None:
        """Show the collision shapes in place of the visual meshes, or these."""
        for handles, is_shown in ((self._solids, self._solids_box.value), (self._visuals, not self._solids_box.value)):
            for handle in handles:
                handle.visible = is_shown

    def _play(self) -> None:
        """Move the time slider on while the trajectory plays, until the viewer is closed."""
        before = monotonic()
        while not self._is_closed.wait(1.0 / PICTURES_PER_SECOND):
            elapsed, before = monotonic() - before, monotonic()
            if self.is_playing:
                self._time.value = min(self._time.value + elapsed, self._plan.trajectory.duration)
                if self._time.value >= self._plan.trajectory.duration:
                    self.play(False)


def _path(parent: str, name: str) -> str:
    """Return the name of a part that moves with its parent."""
    return "/".join([parent, name])


def _put(handle: Any, rotation: FloatArray, position: FloatArray) -> None:
    """Move a drawing to a rotation (3, 3) and a position (3,), m, in its parent's frame."""
    x, y, z, w = quaternion(rotation)
    handle.wxyz, handle.position = np.array([w, x, y, z]), position


def _style(colour: Colour) -> Style:
    """Return the style of a visual mesh."""
    red, green, blue = (round(255.0 * part) for part in colour[:3])
    name = f"#{red:02X}{green:02X}{blue:02X}"
    return Style(name, name, colour[3])


def _rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue from 0 to 255 of `#RRGGBB`."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
