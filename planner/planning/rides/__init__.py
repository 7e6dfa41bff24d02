"""Rides on moving objects: when the robot gets on, and the latest start of the program."""
