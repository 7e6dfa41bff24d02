"""What is done with the time on a path, whichever back end put it there."""
