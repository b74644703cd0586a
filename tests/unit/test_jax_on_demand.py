"""No module loads JAX when it is imported; what is told to JAX before it is there is done when it comes."""

from __future__ import annotations

import ast
import re
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import swashplate
from swashplate.jax_on_demand import jax, jit, jnp

_NEEDING = ("jax",)
_NAMED = re.compile(rf"^\s*(import\s.*\b|from\s+)({'|'.join(_NEEDING)})\b", re.MULTILINE)
"""A line that may import one of them, in code or in a text."""
SOURCE = Path(swashplate.__file__).parent


def _said(code: str) -> str:
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


def _loading(tree: ast.Module) -> Iterator[int]:
    """Lines of imports of JAX that run when the module is imported, those for types alone left out."""
    waiting: list[ast.stmt] = list(tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names]
            if any(name.partition(".")[0] in _NEEDING for name in names):
                yield node.lineno
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            waiting += node.orelse
        elif isinstance(node, ast.If | ast.Try | ast.With | ast.ClassDef):
            waiting += [one for one in ast.iter_child_nodes(node) if isinstance(one, ast.stmt)]


def test_no_module_loads_jax_when_it_is_imported() -> None:
    sources = {str(path.relative_to(SOURCE)): path.read_text(encoding="utf-8") for path in SOURCE.rglob("*.py")}
    found = {name for name, code in sources.items() if _NAMED.search(code) and any(_loading(ast.parse(code)))}
    assert not found, "take jax and jnp from swashplate.jax_on_demand"


@pytest.mark.parametrize(
    ("code", "lines"),
    [
        ("import jax", [1]),
        ("import numpy\nfrom jax import numpy as jnp", [2]),
        ("try:\n    import jax.numpy\nexcept ImportError:\n    pass", [2]),
        ("def f():\n    import jax", []),
        ("if TYPE_CHECKING:\n    import jax", []),
    ],
)
def test_a_module_that_does_would_be_found(code: str, lines: list[int]) -> None:
    assert list(_loading(ast.parse(code))) == lines
    assert _NAMED.search(code)


def test_a_controller_is_designed_without_it() -> None:
    code = "import sys, swashplate as sp; sp.design_controller(sp.vehicle('coax')); print('jax' in sys.modules)"
    assert _said(code) == "False"


def test_what_it_is_told_before_is_done_when_it_comes() -> None:
    code = (
        "import sys\n"
        "from swashplate.jax_on_demand import jnp, option\n"
        "from swashplate.simulation.dynamics import enable_double_precision\n"
        "enable_double_precision()\n"
        "print('jax' in sys.modules, option('jax_enable_x64'))\n"
        "print(jnp.zeros(3).dtype, option('jax_enable_x64'))\n"
    )
    assert _said(code).splitlines() == ["False True", "float64 True"]


def test_jax_of_the_users_own_is_told_at_once() -> None:
    code = (
        "import jax\n"
        "from swashplate.simulation.dynamics import enable_double_precision\n"
        "enable_double_precision()\n"
        "print(jax.numpy.zeros(3).dtype)\n"
    )
    assert _said(code) == "float64"


def test_threads_that_all_need_it_first_find_it_whole() -> None:
    code = (
        "from concurrent.futures import ThreadPoolExecutor\n"
        "from swashplate.jax_on_demand import jnp\n"
        "from swashplate.simulation.dynamics import enable_double_precision\n"
        "def first(_):\n"
        "    enable_double_precision()\n"
        "    return jnp.zeros(3).dtype.name\n"
        "with ThreadPoolExecutor(8) as pool:\n"
        "    print(set(pool.map(first, range(8))))\n"
    )
    assert _said(code) == "{'float64'}"


def test_a_function_is_compiled_once_and_keeps_its_name() -> None:
    traced = []

    @jit(static_argnums=0)
    def twice(power: int, x: jax.Array) -> jax.Array:
        """Doubled."""
        traced.append(power)
        return 2.0 * x**power

    assert [float(twice(2, jnp.asarray(x))) for x in (1.0, 3.0)] == [2.0, 18.0]
    assert traced == [2]
    assert twice._cache_size() == 1
    assert (twice.__name__, twice.__doc__) == ("twice", "Doubled.")


@pytest.mark.parametrize(("kind", "enough"), [(resource.RLIMIT_AS, 2.0e9), (resource.RLIMIT_DATA, 0.5e9)])
def test_too_little_memory_is_told_and_enough_is_enough(kind: int, enough: float) -> None:
    """The compiler would end the process with a segmentation fault (0.5 of what is enough), and does not with it."""
    code = (
        "import os, resource, sys\nkind, limit = map(int, sys.argv[1:])\n"
        "if hasattr(os, 'sched_setaffinity'):\n"  # every core's threads need some more
        "    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])\n"
        "resource.setrlimit(kind, (limit, resource.getrlimit(kind)[1]))\n"
        "from swashplate.errors import SwashError\n"
        "from swashplate.jax_on_demand import jit, jnp\n"
        "try:\n    jit()(lambda x: jnp.sin(x) + 1.0)(2.0)\nexcept SwashError as error:\n    sys.exit(str(error))"
    )

    def run(limit: float) -> subprocess.CompletedProcess[str]:
        words = [sys.executable, "-c", code, str(int(kind)), str(int(limit))]
        return subprocess.run(words, capture_output=True, text=True, check=False)

    little = run(0.5 * enough)
    assert little.returncode == 1
    assert little.stderr.count("\n") == 1
    assert f"needs {enough / 1e9:g} GB" in little.stderr
    more = run(1.05 * enough)
    assert more.returncode == 0, more.stderr
