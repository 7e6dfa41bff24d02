"""Examples of requests, and the recorded answers to them."""
