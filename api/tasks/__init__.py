"""The operations of the service by subject: each is declared once, beside the function that runs it in a worker.

The server reads the declarations, too, and must stay small: what needs the robotics libraries is imported inside the
functions.
"""
