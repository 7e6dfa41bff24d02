"""The server's side of the operations: it moves bytes between callers, the database and the workers."""
