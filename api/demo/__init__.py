"""The demo: the real service plans the cases of four published works, over HTTP."""

from api.demo.run import run_demo

__all__ = ["run_demo"]
