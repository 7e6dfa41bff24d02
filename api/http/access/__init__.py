"""Access to the service: API keys with their scopes and allowances, and web sites."""
