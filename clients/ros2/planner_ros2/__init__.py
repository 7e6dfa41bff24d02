"""MoveIt-style services of ROS 2, answered by the planner service through rosbridge."""
