"""Which links are checked against each other, by sampling; the truth is a circle's."""

from __future__ import annotations

import numpy as np
import pytest

from planner import Robot, load_robot
from planner.robots.collision.pairs import contacts

JOINT = """<joint name="{child}_joint" type="revolute"><parent link="{parent}"/><child link="{child}"/>
  <axis xyz="0 0 1"/><limit lower="-3.14159265" upper="3.14159265" velocity="1" effort="1"/></joint>"""


def balls(radius: float) -> Robot:
    """A ball on the base at (1, 0, 0), and one 1 m from the origin that two joints turn about z."""
    ball = f'<collision><origin xyz="{{}} 0 0"/><geometry><sphere radius="{radius}"/></geometry></collision>'
    links = [
        f'<link name="base">{ball.format(1.0)}</link>',
        '<link name="upper"/>',
        f'<link name="fore">{ball.format(1.0)}</link>',
    ]
    joints = [JOINT.format(parent=parent, child=child) for parent, child in (("base", "upper"), ("upper", "fore"))]
    return Robot.from_urdf(f'<robot name="r">{"".join([*links, *joints])}</robot>')


def share(robot: Robot, count: int) -> float:
    limits = robot.limit("lower"), robot.limit("upper")
    return contacts(robot.model, limits, robot.collision_shapes, [("base", "fore")], count)["base", "fore"]


@pytest.mark.parametrize("radius", [0.01, 0.2, 0.5, 0.9])
def test_the_share_of_contacts_is_that_of_the_circle(radius: float) -> None:
    """The sum of two uniform angles is uniform on the circle: the chord is below 2 r for |angle| < 2 arcsin(r)."""
    expected = 2.0 * np.arcsin(radius) / np.pi
    assert share(balls(radius), 4_000) == pytest.approx(expected, abs=4.0 * np.sqrt(expected / 4_000))


@pytest.mark.parametrize(("radius", "reason"), [(1.01, "always"), (0.9975, "always"), (0.9, None), (0.01, None)])
def test_links_that_always_touch_are_not_checked(radius: float, reason: str | None) -> None:
    (pair,) = balls(radius).collision_pairs
    assert (pair.link_1, pair.link_2, pair.reason) == ("base", "fore", reason)


def test_the_pairs_are_the_same_every_time() -> None:
    first, second = (load_robot("kuka_kr16_2").derived(named_positions={}) for _ in range(2))
    assert first.collision_pairs is second.collision_pairs
    assert [pair.reason for pair in first.collision_pairs].count("always") == 4
    narrower = load_robot("kuka_kr16_2").derived(limits={"joint_a2": {"upper": -1.0}})
    assert narrower.collision_pairs is not first.collision_pairs
