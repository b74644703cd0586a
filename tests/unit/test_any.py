"""How many annotations say nothing: `Any` in a signature or a field."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import swashplate

HOUSE = Path(swashplate.__file__).parent
FOLDERS = ("identification", "filtering", "engine")
MOST = 0.05
"""Share in each of the folders above, and in the whole package."""


def annotations(tree: ast.AST) -> Iterator[ast.expr]:
    """Of arguments, results and fields."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            each = node.args
            given = [*each.posonlyargs, *each.args, *each.kwonlyargs, each.vararg, each.kwarg]
            yield from (one.annotation for one in given if one is not None and one.annotation is not None)
            if node.returns is not None:
                yield node.returns
        elif isinstance(node, ast.AnnAssign):
            yield node.annotation


def share(source: list[str]) -> float:
    """Of annotations in which `Any` stands."""
    every = [one for text in source for one in annotations(ast.parse(text))]
    vague = [any(isinstance(n, ast.Name) and n.id == "Any" for n in ast.walk(one)) for one in every]
    return sum(vague) / len(every)


def _texts(folder: Path) -> list[str]:
    return [path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))]


def test_few_annotations_say_any() -> None:
    shares = {name: share(_texts(HOUSE / name)) for name in FOLDERS}
    assert {name: found for name, found in shares.items() if found > MOST} == {}
    assert share(_texts(HOUSE)) <= MOST


def test_arguments_results_and_fields_count() -> None:
    assert share(["def f(x: Any, *y: int, z: list[Any] = ()) -> None: ..."]) == 0.5
    assert share(["class A:\n    x: dict[str, Any]\n    y: int\n"]) == 0.5
