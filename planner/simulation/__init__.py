"""Plans in a physics simulator (MuJoCo, extra `models`)."""

from planner.simulation.contacts import Contact
from planner.simulation.simulate import FeedForward, Servo, Simulation, simulate

__all__ = ["Contact", "FeedForward", "Servo", "Simulation", "simulate"]
