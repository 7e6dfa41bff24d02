"""Runs of plans: in MuJoCo, and on a robot of ROS 2."""
