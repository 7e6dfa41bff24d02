"""Makes a client of the service: `python -m clients.generate java --output my-client`.

The generators come with the extra `clients`; Java and Go need a Java runtime (`default-jre-headless`).
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import httpx

from clients.document import document

if TYPE_CHECKING:
    from collections.abc import Callable

PYTHON_OPTIONS = Path(__file__).with_name("python.yml")
"""The options of the generator for Python."""

TYPESCRIPT_GENERATOR = "@hey-api/openapi-ts@0.99.0"
"""The package of the generator for TypeScript, which npm fetches."""

TYPESCRIPT = "typescript@5.9.3"
"""The package of the compiler that the generator reads its own output with."""

JAVA_OPTIONS = (
    "library=native,openApiNullable=false,hideGenerationTimestamp=true,groupId=planner,artifactId=planner-client,"
    "invokerPackage=planner.client,apiPackage=planner.client.api,modelPackage=planner.client.model"
)
"""The generator's options for Java: its own HTTP client, and packages under `planner.client`."""

GO_OPTIONS = "packageName=planner,useOneOfDiscriminatorLookup=true,enumClassPrefix=true"
"""The generator's options for Go: variants are chosen by their `kind`, names of constants begin with their type."""


def python(openapi: Path, output: Path) -> None:
    """Make a package for Python, by openapi-python-client."""
    generator = (sys.executable, "-m", "openapi_python_client", "generate", "--meta", "none", "--fail-on-warning")
    _run(*generator, "--overwrite", "--path", openapi, "--config", PYTHON_OPTIONS, "--output-path", output)


def typescript(openapi: Path, output: Path) -> None:
    """Make modules for TypeScript, by openapi-ts of Hey API."""
    packages = ("--package", TYPESCRIPT_GENERATOR, "--package", TYPESCRIPT)
    _run("npx", "--yes", *packages, "openapi-ts", "--input", openapi, "--output", output)


def java(openapi: Path, output: Path) -> None:
    """Make a project for Java, by OpenAPI Generator."""
    _run_openapi_generator("java", JAVA_OPTIONS, openapi, output)


def go(openapi: Path, output: Path) -> None:
    """Make a module for Go, by OpenAPI Generator."""
    _run_openapi_generator("go", GO_OPTIONS, openapi, output)


GENERATORS: dict[str, Callable[[Path, Path], None]] = {
    "python": python,
    "typescript": typescript,
    "java": java,
    "go": go,
}
"""What makes the client of each language, from the file of the document into a folder."""


def _run_openapi_generator(language: str, options: str, openapi: Path, output: Path) -> None:
    generator = ("openapi-generator-cli", "generate", "--generator-name", language, "--additional-properties", options)
    module = ("--git-host", "example.com", "--git-user-id", "planner", "--git-repo-id", "client")
    _run(*generator, *module, "--input-spec", openapi, "--output", output)


def _run(*command: str | Path) -> None:
    """Run a generator, and show its output only if it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - a command of this file
    if done.returncode != 0:
        sys.exit(f"{done.stdout}{done.stderr}\n{command[0]} failed with status {done.returncode}")


def main() -> None:
    """Make one client, of a running service or of this code."""
    parser = argparse.ArgumentParser(prog="python -m clients.generate", description=__doc__)
    parser.add_argument("language", choices=GENERATORS)
    parser.add_argument("--output", type=Path, help="the folder to write, by default planner-client-LANGUAGE")
    parser.add_argument("--service", metavar="URL", help="a running service, by default what this code would serve")
    asked = parser.parse_args()
    output = asked.output or Path(f"planner-client-{asked.language}")
    if asked.service is None:
        content = document()
    else:
        content = httpx.get(f"{asked.service.rstrip('/')}/openapi.json").raise_for_status().content
    with tempfile.TemporaryDirectory() as folder:
        openapi = Path(folder) / "openapi.json"
        openapi.write_bytes(content)
        GENERATORS[asked.language](openapi, output.absolute())


if __name__ == "__main__":
    main()
