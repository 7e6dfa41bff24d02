"""Lists of waypoints: the poses they ask, the joint positions they may have, and the choice among these."""
