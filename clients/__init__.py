"""Clients of the service in other languages, which generators make from its OpenAPI document; none is kept here."""
