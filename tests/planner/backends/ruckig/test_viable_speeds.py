"""Speeds at which joints can pass positions near their limits, against the library's fastest stops."""

from __future__ import annotations

import numpy as np
import pytest
import ruckig

from planner.backends.ruckig.viable_speeds import ViableSpeeds

VELOCITY, ACCELERATION, JERK = 2.0, 3.0, 20.0


def extremes_of_stop(velocity: float, acceleration: float) -> list[float]:
    """Return the least and the greatest position on the fastest motion from 0 to rest."""
    target, output = ruckig.InputParameter(1), ruckig.Trajectory(1)
    target.control_interface = ruckig.ControlInterface.Velocity
    target.current_velocity, target.current_acceleration = [velocity], [acceleration]
    target.max_acceleration, target.max_jerk = [ACCELERATION], [JERK]
    assert ruckig.Ruckig(1).calculate(target, output) == ruckig.Result.Working
    positions = [output.at_time(t)[0][0] for t in np.linspace(0.0, output.duration, 501)]
    return [min(positions), max(positions)]


def highest(above: float, below: float, acceleration: float, direction: float) -> float:
    viable = ViableSpeeds(*(np.full((1, 1), x) for x in (above, below, VELOCITY, VELOCITY, ACCELERATION, JERK)))
    return float(viable.highest(np.full((1, 1), acceleration), np.full((1, 1), direction))[0, 0])


@pytest.mark.parametrize("above", [1e-4, 0.01, 0.1, 0.5])
@pytest.mark.parametrize("below", [1e-4, 0.05, 0.5])
@pytest.mark.parametrize("acceleration", [-2.9, -1.0, 0.0, 0.5, 2.5])
@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_stops_within_the_room_before_and_after(
    above: float, below: float, acceleration: float, direction: float
) -> None:
    velocity = direction * highest(above, below, acceleration, direction)
    # Backwards in time velocities change their sign, accelerations do not.
    ahead = extremes_of_stop(velocity, acceleration)[direction > 0.0]
    behind = extremes_of_stop(-velocity, acceleration)[direction < 0.0]
    for position in (ahead, behind):
        assert velocity == 0.0 or -below * (1.0 + 1e-6) <= position <= above * (1.0 + 1e-6)
    assert abs(velocity) + acceleration**2 / (2.0 * JERK) <= VELOCITY * (1.0 + 1e-9)


@pytest.mark.parametrize("room", [1e-4, 0.01, 0.1, 0.3])
def test_without_acceleration_all_of_the_room_is_used(room: float) -> None:
    speed = highest(room, np.inf, 0.0, 1.0)
    assert extremes_of_stop(speed, 0.0)[1] == pytest.approx(room, rel=1e-6)
    assert highest(np.inf, room, 0.0, 1.0) == pytest.approx(speed, rel=1e-12)


def test_braking_already_a_joint_may_be_faster() -> None:
    assert highest(0.1, np.inf, -2.5, 1.0) > 1.2 * highest(0.1, np.inf, 0.0, 1.0)
    assert highest(0.1, np.inf, 2.5, 1.0) < 0.8 * highest(0.1, np.inf, 0.0, 1.0)
    assert highest(np.inf, np.inf, 0.0, 1.0) == VELOCITY
