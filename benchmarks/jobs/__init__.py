"""Jobs as robot programmers send them, through every back end."""
