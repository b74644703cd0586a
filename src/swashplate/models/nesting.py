"""Nested states to flat rows of numbers and back: equations see `state.body.u`, compiled loops carry one vector."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, cast


def leaves(tree: Any) -> Iterator[Any]:
    """The scalars of nested named tuples in order; a part that is None has none."""
    if tree is None:
        return
    if hasattr(tree, "_fields"):
        for part in tree:
            yield from leaves(part)
    else:
        yield tree


def rebuild(template: Any, values: Sequence[Any]) -> Any:
    """The template's nested named tuples with their scalars replaced by `values`, in the order of `leaves`."""
    rest = iter(values)

    def build(part: Any) -> Any:
        if part is None:
            return None
        if hasattr(part, "_fields"):
            return cast(Any, type(part))(*(build(inner) for inner in part))
        return next(rest)

    return build(template)
