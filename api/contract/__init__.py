"""The JSON of the HTTP contract as pydantic models."""
