"""Jobs as robot programmers send them, made by code, with answers known from independent sources."""
