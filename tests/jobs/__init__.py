"""Jobs as robot programmers send them, made by code, with what is known of their answers from elsewhere."""
