"""Arms of ten makers as their descriptions are written; lengths and limits are the makers', the text is ours.

Lengths, ranges and speeds agree with the packages for ROS of makers and ROS-Industrial. Reaches are from the
data sheets.
"""

from __future__ import annotations

from math import pi, radians
from typing import NamedTuple

from tests.planner.robots.urdfs import joint, link, robot

FREE = (-float("inf"), float("inf"))
"""The range of a joint without an end."""

Row = tuple[str, str, str, tuple[float, float], float]


class Arm(NamedTuple):
    """An arm of a maker.

    Attributes:
        rows: Origin, roll-pitch-yaw and axis of each joint as written, its range (degrees) and speed (degrees/s).
        flange: Origin and roll-pitch-yaw of the tool frame.
        reach: The reach of the data sheet, m; None: the sheet does not say between which points.
        to_flange: Whether the reach is that of the flange from the second joint; otherwise that of the fifth joint's
            centre from the first axis.
        effort: Effort limits as written; several makers' packages have 0 for "not known".
        names: Names of the joints, with {} for the number.
    """

    rows: tuple[Row, ...]
    flange: tuple[str, str]
    reach: float | None
    to_flange: bool = False
    effort: float = 0.0
    names: str = "joint_{}"

    def urdf(self) -> str:
        """Return the URDF, with a tool frame and a second name of the base as ROS-Industrial has them."""
        names = ["base_link", *(f"link_{k + 1}" for k in range(len(self.rows)))]
        joints = []
        for k, (xyz, rpy, axis, (lower, upper), speed) in enumerate(self.rows):
            is_continuous = (lower, upper) == FREE
            bounds = "" if is_continuous else f'lower="{radians(lower)}" upper="{radians(upper)}" '
            joints.append(
                joint(
                    self.names.format(k + 1),
                    names[k],
                    names[k + 1],
                    kind="continuous" if is_continuous else "revolute",
                    origin=f'<origin xyz="{xyz}" rpy="{rpy}"/>',
                    axis=f'<axis xyz="{axis}"/>',
                    limit=f'<limit effort="{self.effort}" {bounds}velocity="{radians(speed)}"/>',
                    more='<dynamics damping="0.0" friction="0.0"/>',
                )
            )
        xyz, rpy = self.flange
        tool = joint(
            f"{names[-1]}-tool0",
            names[-1],
            "tool0",
            kind="fixed",
            origin=f'<origin xyz="{xyz}" rpy="{rpy}"/>',
            axis="",
            limit="",
        )
        base = joint(
            "base_link-base", "base_link", "base", kind="fixed", origin='<origin xyz="0 0 0"/>', axis="", limit=""
        )
        return robot(*map(link, [*names, "base", "tool0"]), *joints, tool, base)


QUARTER = f"{pi / 2}"
ARMS: dict[str, Arm] = {
    "abb_irb120": Arm(
        (
            ("0 0 0", "0 0 0", "0 0 1", (-165, 165), 250),
            ("0 0 0.29", "0 0 0", "0 1 0", (-110, 110), 250),
            ("0 0 0.27", "0 0 0", "0 1 0", (-110, 70), 250),
            ("0 0 0.07", "0 0 0", "1 0 0", (-160, 160), 320),
            ("0.302 0 0", "0 0 0", "0 1 0", (-120, 120), 320),
            ("0.072 0 0", "0 0 0", "1 0 0", (-400, 400), 420),
        ),
        ("0 0 0", f"0 {QUARTER} 0"),
        0.580,
    ),
    "fanuc_lrmate200id": Arm(
        (
            ("0 0 0.330", "0 0 0", "0 0 1", (-170, 170), 450),
            ("0.050 0 0", "0 0 0", "0 1 0", (-100, 145), 380),
            ("0 0 0.330", "0 0 0", "0 -1 0", (-140, 280), 520),
            ("0 0 0.035", "0 0 0", "-1 0 0", (-190, 190), 550),
            ("0.335 0 0", "0 0 0", "0 -1 0", (-125, 125), 545),
            ("0.080 0 0", "0 0 0", "-1 0 0", (-360, 360), 1000),
        ),
        ("0 0 0", f"{pi} -{QUARTER} 0"),
        0.717,
    ),
    "yaskawa_gp7": Arm(
        (
            ("0 0 0.330", "0 0 0", "0 0 1", (-170, 170), 375),
            ("0.040 0 0", "0 0 0", "0 1 0", (-65, 145), 315),
            ("0 0 0.445", "0 0 0", "0 -1 0", (-70, 190), 410),
            ("0.440 0 0.040", "0 0 0", "-1 0 0", (-190, 190), 550),
            ("0 0 0", "0 0 0", "0 -1 0", (-135, 135), 550),
            ("0 0 0", "0 0 0", "-1 0 0", (-360, 360), 1000),
        ),
        ("0.080 0 0", "3.1415926 -1.570796 0"),
        0.927,
        effort=106.82,
    ),
    "staubli_rx160": Arm(
        (
            ("0 0 0.55", "0 0 0", "0 0 1", (-160, 160), 200),
            ("0.15 0 0", "0 0 0", "0 1 0", (-137.5, 137.5), 200),
            ("0 0 0.825", "0 0 0", "0 1 0", (-150, 150), 255),
            ("0 0 0", "0 0 0", "0 0 1", (-270, 270), 315),
            ("0 0 0.625", "0 0 0", "0 1 0", (-105, 120), 360),
            ("0 0 0.11", "0 0 0", "0 0 1", (-270, 270), 870),
        ),
        ("0 0 0", "0 0 0"),
        1.600,
        effort=29.0,
    ),
    "kuka_kr6_r900": Arm(
        (
            ("0 0 0.400", "0 0 0", "0 0 -1", (-170, 170), 360),
            ("0.025 0 0", "0 0 0", "0 1 0", (-190, 45), 300),
            ("0.455 0 0", "0 0 0", "0 1 0", (-120, 156), 360),
            ("0 0 0.035", "0 0 0", "-1 0 0", (-185, 185), 381),
            ("0.420 0 0", "0 0 0", "0 1 0", (-120, 120), 388),
            ("0.080 0 0", "0 0 0", "-1 0 0", (-350, 350), 615),
        ),
        ("0 0 0", f"0 {QUARTER} 0"),
        0.9015,
        names="joint_a{}",
    ),
    "kawasaki_rs007l": Arm(
        (
            ("0 0 0.36", "0 0 0", "0 0 -1", (-180, 180), 370),
            ("0 0 0", f"0 -{QUARTER} 0", "0 0 1", (-135, 135), 310),
            ("0.455 0 0", "0 0 0", "0 0 -1", (-157, 157), 410),
            ("0.0925 0 0", f"0 {QUARTER} 0", "0 0 1", (-200, 200), 550),
            ("0 0 0.3825", f"0 -{QUARTER} 0", "0 0 -1", (-125, 125), 550),
            ("0.078 0 0", f"0 {QUARTER} 0", "0 0 1", (-360, 360), 1000),
        ),
        ("0 0 0", "0 0 0"),
        0.930,
        effort=1000.0,
        names="joint{}",
    ),
    "denso_vs060": Arm(
        (
            ("0 4.04121e-17 0.182", "0 -0 0 ", "0 0 1", (-170, 170), 28.65),
            ("0 3.61933e-17 0.163", "0 -0 0 ", "0 1 0", (-120, 120), 28.65),
            ("0 6.77236e-17 0.305", "0 -0 0 ", "0 1 0", (-125, 155), 28.65),
            ("-0.01 3.66374e-17 0.165", "0 -0 0 ", "0 0 1", (-270, 270), 28.65),
            ("0 2.9976e-17 0.135", "0 -0 0 ", "0 1 0", (-120, 120), 28.65),
            ("0 1.55431e-17 0.07", "0 -0 0 ", "0 0 1", (-360, 360), 28.65),
        ),
        ("0 0 0", "0 0 0"),
        0.605,
        effort=19.7336,
        names="j{}",
    ),
    "doosan_m1013": Arm(  # right angles are written 1.571
        (
            ("0 0 0.1525", "0 0 0", "0 0 1", (-150, 150), 90),
            ("0 0.0345 0", "0 -1.571 -1.571", "0 0 1", (-150, 150), 90),
            ("0.62 0 0", "0 0 1.571", "0 0 1", (-150, 150), 90),
            ("0 -0.559 0", "1.571 0 0", "0 0 1", (-150, 150), 90),
            ("0 0 0", "-1.571 0 0", "0 0 1", (-150, 150), 90),
            ("0 -0.121 0", "1.571 0 0", "0 0 1", (-150, 150), 90),
        ),
        ("0 0 0", "0 0 0"),
        1.300,
        to_flange=True,
        effort=30.0,
        names="joint{}",
    ),
    "kinova_gen3": Arm(  # seven joints, four of them without an end
        (
            ("0 0 0.15643", "3.1416 2.7629E-18 -4.9305E-36", "0 0 1", FREE, 80),
            ("0 0.005375 -0.12838", "1.5708 2.1343E-17 -1.1102E-16", "0 0 1", (-138, 138), 80),
            ("0 -0.21038 -0.006375", "-1.5708 1.2326E-32 -2.9122E-16", "0 0 1", FREE, 80),
            ("0 0.006375 -0.21038", "1.5708 -6.6954E-17 -1.6653E-16", "0 0 1", (-152, 152), 80),
            ("0 -0.20843 -0.006375", "-1.5708 2.2204E-16 -6.373E-17", "0 0 1", FREE, 70),
            ("0 0.00017505 -0.10593", "1.5708 9.2076E-28 -8.2157E-15", "0 0 1", (-127, 127), 70),
            ("0 -0.10593 -0.00017505", "-1.5708 -5.5511E-17 9.6396E-17", "0 0 1", FREE, 70),
        ),
        ("0 0 -0.0615250000000001", "3.14159265358979 1.09937075168372E-32 0"),
        0.902,
        to_flange=True,
        effort=39.0,
    ),
    "techman_tm5_700": Arm(
        (
            ("0.000000 0.000000 0.145200", "0.000000 -0.000000 0.000000", "0 0 1", (-270, 270), 180),
            ("0 0 0", "-1.570796 -1.570796 0.000000", "0 0 1", (-180, 180), 180),
            ("0.329000 0 0", "0 0 0", "0 0 1", (-155, 155), 180),
            ("0.311500 0 -0.122300", "0 -0 1.570796", "0 0 1", (-180, 180), 225),
            ("0 -0.106000 0", "1.570796 -0 0", "0 0 1", (-180, 180), 225),
            ("0 -0.113150 0", "1.570796 -0 0", "0 0 1", (-270, 270), 225),
        ),
        ("0 0 0", "0 0 0"),
        None,
        effort=157.0,
        names="{}_joint",
    ),
}
"""By name; the arms of Universal Robots and Franka stand in the catalogue, which makes twelve makers."""
