"""The HTTP service: schemas, worker processes, routes. It holds no robotics. Importing it costs nothing."""
