"""Jobs of the suite that are known to fail, by cause: whoever mends one strikes it out.

An entry is a job, for all back ends, or a job and a back end.
"""

KNOWN_FAILURES: dict[str, tuple[str, ...]] = {
    "A closed form's solution 3e-11 outside of a fixed joint's limits is refused": (
        "fixed_axis-05-ngv_refuelling_arm",
    ),
    "Waypoints on one straight line are passed more slowly than without them": (
        "one_direction-10-date_sorting_arm ruckig",
        "one_direction-10-date_sorting_arm auto",
        "one_direction-09-ngv_refuelling_arm ruckig",
        "one_direction-09-ngv_refuelling_arm auto",
        "one_direction-11-ngv_refuelling_arm ruckig",
        "one_direction-11-ngv_refuelling_arm auto",
    ),
    "ruckig finds no motion through waypoints": ("inspection-12-date_sorting_arm ruckig",),
}
