"""Two versions of the service side by side."""
