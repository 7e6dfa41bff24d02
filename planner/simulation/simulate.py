"""Runs a plan in MuJoCo under a controller: how well a real arm would follow it, and with which torques."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from planner.certificate.clearance import segment_checkers
from planner.errors import InvalidProblem, MissingDynamics
from planner.plans.result import Plan
from planner.plots.picture import Picture
from planner.simulation.contacts import Contact, find_contacts
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

FeedForward = Literal["torque", "gravity", "none"]

SETTLING = 1.0
"""Time that the simulation goes on after the end of the trajectory, as a multiple of the servo's period."""


RANGES = {"cycle": (1e-5, 0.1), "frequency": (0.01, 1e4), "mass_error": (-0.9, 10.0), "steps": (1, 100)}
"""The ranges of the numbers of a servo, both ends included."""

LARGEST_SHARE_OF_CYCLES = 0.05
"""Largest frequency of a servo as a share of the frequency of its cycles: above it, sampling takes the damping away."""


@dataclass(frozen=True)
class Servo:
    """A controller of joint torques: feed-forward, and a servo on the error of position and velocity.

    Attributes:
        cycle: Time between two torques, s; between them the torque is constant.
        frequency: Frequency of the servo, Hz, which damps errors critically. It knows the mass matrix, so all joints
            have this frequency (computed torque control).
        feed_forward: `torque`: the torques of the planned motion; `gravity`: the torques that hold the arm
            at the planned position; `none`: the servo alone.
        mass_error: Share by which the arm's masses and inertias are larger than the controller believes.
        steps: Steps of the integration in a cycle.
    """

    cycle: float = 0.001
    frequency: float = 10.0
    feed_forward: FeedForward = "torque"
    mass_error: float = 0.0
    steps: int = 4

    def __post_init__(self) -> None:
        """Refuse what no controller can have.

        Raises:
            InvalidProblem: A number is out of its range.
        """
        faults = [
            ((name,), f"`{name}` must be between {low:g} and {high:g}; got {getattr(self, name)}")
            for name, (low, high) in RANGES.items()
            if not low <= getattr(self, name) <= high
        ]
        if not faults and self.frequency * self.cycle > LARGEST_SHARE_OF_CYCLES:
            text = f"`frequency` must be at most {LARGEST_SHARE_OF_CYCLES / self.cycle:g} Hz with this cycle"
            faults = [(("frequency",), f"{text}; got {self.frequency:g}")]
        if faults:
            raise InvalidProblem(faults)


@dataclass(frozen=True, eq=False)
class Simulation:
    """A simulated run of a plan; rows are the controller's cycles.

    Attributes:
        plan: The plan.
        servo: The controller.
        time: (N,), s.
        position: (N, joints), of the simulated arm, rad or m.
        planned: (N, joints), the planned positions.
        torque: (N, joints), set by the controller, within the robot's own torque limits, N m or N.
        planned_torque: (N, joints), the torques of the planned motion.
        limited: (N, joints), whether the robot's torque limit cut the torque.
        contacts: The overlaps of the arm with itself and its surroundings, in the order of their begin.
    """

    plan: Plan
    servo: Servo
    time: FloatArray
    position: FloatArray
    planned: FloatArray
    torque: FloatArray
    planned_torque: FloatArray
    limited: np.ndarray
    contacts: tuple[Contact, ...]

    @cached_property
    def following_error(self) -> FloatArray:
        """The largest distance (joints,) of the simulated from the planned position, rad or m."""
        errors: FloatArray = np.abs(self.position - self.planned).max(axis=0)
        return errors

    @cached_property
    def end_error(self) -> FloatArray:
        """The distance (joints,) from the goal at the end of the simulation, rad or m."""
        errors: FloatArray = np.abs(self.position[-1] - self.planned[-1])
        return errors

    @cached_property
    def torque_ratio(self) -> FloatArray:
        """The largest torque over the largest planned torque (joints,); NaN where none is planned."""
        peak, planned = (np.abs(torque).max(axis=0) for torque in (self.torque, self.planned_torque))
        ratio: FloatArray = np.divide(
            peak, planned, out=np.full_like(peak, np.nan), where=planned > ROUNDING * planned.max()
        )
        return ratio

    def plot(self) -> Picture:
        """Draw the following errors, the torques beside the planned ones, and the contacts."""
        from planner.plots.simulated import draw_simulated

        servo = self.servo
        fed = f"feed-forward: {servo.feed_forward}; servo of {servo.frequency:g} Hz"
        facts = f"{fed}; masses {servo.mass_error:+.0%}; dashed: planned"
        errors = self.position - self.planned
        contacts = {f"contact: {' and '.join(contact.pair)}": contact.time for contact in self.contacts}
        return draw_simulated(self.plan, facts, self.time, errors, self.torque, self.planned_torque, contacts)


def simulate(plan: Plan, servo: Servo = Servo()) -> Simulation:
    """Run a plan in MuJoCo.

    The arm has the robot's inertias, friction, rotors, payloads, tools and process forces, as they change along the
    plan. It has no elasticity or backlash. It passes through itself and objects: contacts are found, and exert no
    forces.

    Args:
        plan: The plan.
        servo: The controller.

    Raises:
        MissingDynamics: The robot has no masses.
        InvalidProblem: The cycle is longer than the trajectory.
        ModuleNotFoundError: MuJoCo is not installed (extra `models`).
    """
    from planner.simulation.plant import Plant

    trajectory, dynamics = plan.trajectory, plan.path.dynamics
    if not all(robot.mass > 0.0 for robot in dynamics.robots):
        raise MissingDynamics(f"{plan.problem.robot.id} has no link inertias: its motion cannot be simulated")
    if servo.cycle > trajectory.duration:
        message = f"`cycle` must be shorter than the trajectory, {trajectory.duration:g} s; got {servo.cycle:g}"
        raise InvalidProblem([(("cycle",), message)])
    time = np.arange(0.0, trajectory.duration + SETTLING / servo.frequency, servo.cycle)
    planned = np.array(trajectory.evaluate(np.minimum(time, trajectory.duration), range(3)))
    planned[1:, time > trajectory.duration] = 0.0
    pieces, _ = trajectory.locate(np.minimum(time, trajectory.duration))
    segments, rest = trajectory.segments[pieces], np.zeros_like(planned[0])
    robots = [dynamics.robots[index] for index in dynamics.indices_on(segments)]
    moving = dynamics.torques(segments, *planned)
    fed = {"torque": moving, "gravity": dynamics.torques(segments, planned[0], rest, rest), "none": rest}

    plant = Plant(robots[0], servo.cycle / servo.steps, servo.mass_error)
    rate = 2.0 * np.pi * servo.frequency
    lower, upper = plan.problem.robot.bounds("torque")
    position, torque, limited = (np.empty_like(moving) for _ in range(3))
    plant.set_state(*planned[:2, 0])
    for k, (q, v) in enumerate(zip(planned[0], planned[1], strict=True)):
        if k and robots[k] is not robots[k - 1]:
            plant.carry(robots[k])
        position[k] = plant.position
        correction = rate**2 * (q - position[k]) + 2.0 * rate * (v - plant.velocity)
        needed = fed[servo.feed_forward][k] + plant.mass_matrix() @ correction
        torque[k] = np.clip(needed, lower, upper)
        limited[k] = torque[k] != needed
        plant.move(torque[k], servo.steps)
    checkers = segment_checkers(plan.problem, plan.path.positions)
    contacts = find_contacts([checkers[min(segment, len(checkers) - 1)] for segment in segments], time, position)
    return Simulation(plan, servo, time, position, planned[0], torque, moving, limited.astype(bool), contacts)
