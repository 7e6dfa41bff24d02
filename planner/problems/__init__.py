"""What is asked, and what is wrong with it."""
