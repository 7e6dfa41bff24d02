"""`python -m api` runs the service with the settings of the environment."""

from api.process import serve

if __name__ == "__main__":
    serve()
