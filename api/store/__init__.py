"""The database, which is the truth about robots: SQLite in a folder, or PostgreSQL. Only the server uses it."""
