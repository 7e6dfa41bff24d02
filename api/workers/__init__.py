"""The processes that plan: what they are forked from, what they do, and what they and the server send each other."""
