"""The work of the commands: heavy modules, which a command imports when it runs."""
