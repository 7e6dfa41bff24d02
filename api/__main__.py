"""`python -m api` runs the service with the settings of the environment."""

from api.pool.left_out import leave_out

if __name__ == "__main__":
    leave_out()
    from api.process import serve

    serve()
