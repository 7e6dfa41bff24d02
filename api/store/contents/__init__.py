"""What clients add: robots, with their meshes, and scenes."""
