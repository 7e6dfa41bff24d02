"""The layer between uvicorn and the application: connections, refusals without parsing, answers in pieces."""
