"""The HTTP side of the service: routers by subject, what their routes depend on, and the OpenAPI document."""
