"""The law along a curve that keeps jerk limits, too: shared by the back ends that promise them."""
