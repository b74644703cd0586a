"""Which extra of the package brings which library, and the words where one is missing."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from swashplate.errors import MissingLibraryError

EXTRA_OF: Mapping[str, str] = {
    "jax": "cuda",
    "control": "control",
    "matplotlib": "plot",
    "casadi": "model",
    "ziglang": "compiler",
    "pymavlink": "link",
    "pyulog": "logs",
    "rosbags": "logs",
    "distributed": "scale",
    "pyarrow": "scale",
}
"""Extras of `pyproject.toml` by the module that they bring; `all` brings every one."""


def version_of(distribution: str) -> str:
    """The version of an installed distribution, "not installed" where it is not."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "not installed"


def install(module: str) -> str:
    """The command that installs what a module belongs to, quoted for every shell."""
    library = module.partition(".")[0]
    return f"pip install 'swashplate[{EXTRA_OF[library]}]'" if library in EXTRA_OF else f"pip install {library}"


def missing(module: str, *, what: str = "this", where: str | Path | None = None) -> MissingLibraryError:
    """The error for a library that is not installed: what needs it, and the command that installs it.

    Args:
        module: its name, as it is imported; of a submodule the first part counts.
        what: that which needs it, to begin a sentence ("C code").
        where: the file that it is needed for.
    """
    told = f"{what} needs the library {module.partition('.')[0]}, which is not installed here."
    return MissingLibraryError(told, where=where, hint=f"Install it with: {install(module)}")


def library(module: str, *, what: str = "this", where: str | Path | None = None) -> Any:
    """The module of this name, loaded now.

    Raises:
        MissingLibraryError: where it is not installed; see `missing` for the arguments.
    """
    try:
        import_module(module.partition(".")[0])
        return import_module(module)
    except ImportError:
        raise missing(module, what=what, where=where) from None
