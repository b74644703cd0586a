"""Which statement of somebody's equations CasADi cannot trace, and in which line of which file."""

from __future__ import annotations

import traceback
from pathlib import Path

from swashplate.errors import ExportError

_OURS = Path(__file__).parent.parent
_LIBRARIES = {"casadi", "numpy"}
_LONGEST = 160


def untraced(error: Exception, what: str, where: str) -> ExportError:
    """The error that is told of a function that cannot be traced.

    The statement is the innermost outside of this package and of the libraries that it is traced with: what an equation
    of somebody's own calls of ours is not to blame. Where there is none, it is one of our models.

    Args:
        error: what came of the trace.
        what: is traced. where: whose it is.
    """
    frames = traceback.extract_tb(error.__traceback__)
    foreign = [f for f in frames if _OURS not in (path := Path(f.filename)).parents and not _LIBRARIES & {*path.parts}]
    models = [f for f in frames if _OURS / "models" in Path(f.filename).parents]
    said = " ".join(str(error).split()) or type(error).__name__
    said = said if len(said) <= _LONGEST else f"{said[:_LONGEST]}..."
    at = next((f for f in reversed(foreign or models)), None)
    place = "" if at is None else f" in line {at.lineno} of {Path(at.filename).name}, `{at.line}`"
    return ExportError(
        f"CasADi cannot trace the {what}{place}: {said}.",
        where=where,
        hint="An equation uses arithmetic and the operations of xp: xp.where instead of if, xp.maximum instead of max.",
    )
