"""JAX, loaded when something of it is first used: commands that trace nothing do not wait for it.

Modules take `jax`, `jnp` and `jit` from here. It takes a third of a second to load JAX, a quarter of `swash control
design` (docs/decisions/0151).
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Sequence
from functools import cached_property, update_wrapper
from threading import RLock
from types import ModuleType
from typing import TYPE_CHECKING, Any

from swashplate.errors import SwashError
from swashplate.systems import resource

_SETTINGS: dict[str, object] = {"jax_enable_x64": True}
_LOCK = RLock()


def set_option(name: str, value: object) -> None:
    """Set an option of JAX: now where it is loaded, otherwise as soon as it is."""
    with _LOCK:
        _SETTINGS[name] = value
    if "jax" in sys.modules:
        _catch_up()


def option(name: str) -> Any:
    """An option of JAX as it is, or as it was set before JAX is there: here, or as text by an environment variable."""
    if "jax" not in sys.modules:
        return _SETTINGS.get(name, os.environ.get(name.upper()))
    return _catch_up().config.values[name]


class _OnDemand(ModuleType):
    """A module that is imported when something of it is asked for."""

    def __getattr__(self, name: str) -> Any:
        _refuse_little_memory()
        module = importlib.import_module(self.__name__)
        _catch_up()
        value = getattr(module, name)
        setattr(self, name, value)  # the next time it is found without this function
        return value


def _catch_up() -> Any:
    """JAX, whole also where another thread is still loading it, with all that it had to be told."""
    _refuse_little_memory()
    loaded = importlib.import_module("jax")
    with _LOCK:
        while _SETTINGS:
            loaded.config.update(*_SETTINGS.popitem())
    return loaded


def _refuse_little_memory() -> None:
    """With less memory than this JAX's compiler ends the process without a word: a segmentation fault.

    Raises:
        SwashError: where a limit of the system leaves too little; what else runs on the machine is not looked at.
    """
    if "jax" in sys.modules or resource is None:
        return
    for kind, least, command in ((resource.RLIMIT_AS, 2.0e9, "ulimit -v"), (resource.RLIMIT_DATA, 0.5e9, "ulimit -d")):
        limit = resource.getrlimit(kind)[0]
        if limit != resource.RLIM_INFINITY and limit < least:
            raise SwashError(
                f"this process may have {limit / 1e9:.2g} GB of memory ({command}), and JAX, which compiles the "
                f"equations, needs {least / 1e9:g} GB, on a machine with many cores more.",
                hint=f"Raise the limit: {command} unlimited.",
            )


if TYPE_CHECKING:
    import jax as jax
    import jax.numpy as jnp
else:
    jax, jnp = _OnDemand("jax"), _OnDemand("jax.numpy")


class _Jitted:
    """A function that `jax.jit` is given when it is first called; attributes are those of the compiled function."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self._function, self._options = function, options
        update_wrapper(self, function)

    @cached_property
    def _compiled(self) -> Any:
        return jax.jit(self._function, **self._options)

    def __call__(self, *values: Any, **named: Any) -> Any:
        return self._compiled(*values, **named)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._compiled, name)


def jit(
    *,
    static_argnums: int | Sequence[int] | None = None,
    static_argnames: str | Sequence[str] | None = None,
    compiler_options: dict[str, Any] | None = None,
) -> Callable[[Callable[..., Any]], Any]:
    """`jax.jit` as a decorator of a module's functions, without loading JAX when the module is."""
    static = {"static_argnums": static_argnums, "static_argnames": static_argnames}
    return lambda function: _Jitted(function, {**static, "compiler_options": compiler_options})
