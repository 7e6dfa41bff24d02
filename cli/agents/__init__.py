"""The service as tools of AI agents, by the Model Context Protocol."""
