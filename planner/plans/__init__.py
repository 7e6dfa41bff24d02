"""The certified plan, and what is made of it."""
