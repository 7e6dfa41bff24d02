"""`python -m api.server` runs the service with the settings of the environment."""

from api.server.process import serve

if __name__ == "__main__":
    serve()
