"""No two files of the package need each other; imports in functions count, those for types alone load nothing."""

from __future__ import annotations

from pathlib import Path

import grimp
import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components


def _circles(package: str) -> list[list[str]]:
    """Groups of modules that import each other, directly or around."""
    graph = grimp.build_graph(package, cache_dir=None, exclude_type_checking_imports=True)
    names = sorted(graph.modules)
    place = {name: i for i, name in enumerate(names)}
    pairs = [(place[name], place[other]) for name in names for other in graph.find_modules_directly_imported_by(name)]
    rows, columns = np.array(pairs).reshape(-1, 2).T
    links = csr_array((np.ones(rows.size), (rows, columns)), shape=(len(names), len(names)))
    _, group = connected_components(links, directed=True, connection="strong")
    members = [[name for name in names if group[place[name]] == number] for number in range(max(group) + 1)]
    return [circle for circle in members if len(circle) > 1]


def test_the_package_has_no_circle_of_any_size() -> None:
    assert _circles("swashplate") == []


def test_a_circle_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "round").mkdir()
    for name, text in {
        "__init__": "",
        "a": "def f():\n    from round import b\n",
        "b": "class A:\n    def f(self):\n        from round import a\n",
        "c": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from round import d\n",
        "d": "from round import c\n",
    }.items():
        (tmp_path / "round" / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    assert _circles("round") == [["round.a", "round.b"]]
