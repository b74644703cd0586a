"""Nested states to flat rows of numbers and back: equations see `state.body.u`, compiled loops carry one vector."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, cast


def leaves(tree: object) -> Iterator[Any]:
    """The scalars of nested named tuples in order; a part that is None has none."""
    if tree is None:
        return
    if isinstance(tree, tuple):
        for part in tree:
            yield from leaves(part)
    else:
        yield tree


def rebuild(template: object, values: Sequence[object]) -> Any:
    """The template's nested named tuples with their scalars replaced by `values`, in the order of `leaves`."""
    rest = iter(values)

    def build(part: object) -> object:
        if part is None:
            return None
        if isinstance(part, tuple):
            return cast(Any, type(part))(*(build(inner) for inner in part))
        return next(rest)

    return build(template)
