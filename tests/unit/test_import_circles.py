"""No import circle of any size: a package's files can be read one after the other.

Imports within functions count (they are circles that were hidden), those under TYPE_CHECKING do not (nothing is
loaded). What a method needs from a layer above goes through `swashplate.public.resolve`.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import swashplate

HOUSE = Path(swashplate.__file__).parent


def _modules(root: Path) -> dict[str, Path]:
    found = {}
    for place in root.rglob("*.py"):
        parts = (root.name, *place.relative_to(root).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = place
    return found


def _loaded(tree: ast.AST) -> list[ast.stmt]:
    """Every import statement that runs, wherever it stands."""
    found: list[ast.stmt] = []
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append(node)
        found += _loaded(node)
    return found


def imports(root: Path) -> Mapping[str, set[str]]:
    """The modules of a package that each of its modules imports."""
    modules = _modules(root)
    graph: dict[str, set[str]] = {}
    for name, place in modules.items():
        targets = set()
        for node in _loaded(ast.parse(place.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                targets |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                inner = {f"{node.module}.{alias.name}" for alias in node.names}
                targets |= inner & set(modules)
                if inner - set(modules):  # names of the package itself
                    targets.add(node.module)
        graph[name] = (targets & set(modules)) - {name}
    return graph


def circle(graph: Mapping[str, set[str]]) -> list[str]:
    """One circle of the graph, first and last the same; empty where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as found:
        return list(found.args[1])
    return []


def test_no_module_imports_itself_by_any_way() -> None:
    graph = {name: set(targets) for name, targets in imports(HOUSE).items()}
    assert len(graph) > 400
    graph["swashplate.cli.monte_carlo"].discard("swashplate.cli.simulate")  # goes with the verbs of controllers
    assert circle(graph) == []


@pytest.mark.parametrize("hidden", ["", "def f():\n    ", "class A:\n    def f(self):\n        "])
def test_a_circle_is_found_wherever_its_import_stands(tmp_path: Path, hidden: str) -> None:
    house = tmp_path / "house"
    (house / "room").mkdir(parents=True)
    (house / "__init__.py").write_text("")
    (house / "room" / "__init__.py").write_text("from house.door import key\n")
    (house / "door.py").write_text("from house import lock\nkey = 1\n")
    (house / "lock.py").write_text(f"{hidden}from house.room import key\n")
    assert set(circle(imports(house))) == {"house.room", "house.door", "house.lock"}
    (house / "lock.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from house.room import key\n"
    )
    assert circle(imports(house)) == []
