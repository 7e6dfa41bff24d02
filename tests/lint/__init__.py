"""Rules for the text of the repository: `python -m tests.lint` checks them."""
