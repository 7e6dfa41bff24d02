"""Plans in a physics simulator (MuJoCo, extra `models`)."""

from planner.simulation.simulate import FeedForward, Servo, Simulation, simulate

__all__ = ["FeedForward", "Servo", "Simulation", "simulate"]
