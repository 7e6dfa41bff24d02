"""What of a robot can collide: the convex shapes of its links, and which links are checked against each other."""
