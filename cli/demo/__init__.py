"""The demo: the real service plans the cases of four published works, over HTTP."""

from cli.demo.run import run_demo

__all__ = ["run_demo"]
