"""Equations that cannot be traced: the message names the statement, and the line of whoever wrote it."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from swashplate.engine.slopes import slopes_of
from swashplate.engine.untraced import untraced
from swashplate.errors import ExportError
from swashplate.physics.frames import Vector

SOURCE = """def drag(speed, xp):
    size = xp.sqrt(speed * speed)
    if size > 1.0:
        return size
    return 0.0 * size
"""


def _mine(folder: Path) -> Any:
    (folder / "mine.py").write_text(SOURCE)
    spec = importlib.util.spec_from_file_location("mine", folder / "mine.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_statement_and_its_line_are_named(tmp_path: Path) -> None:
    mine = _mine(tmp_path)
    with pytest.raises(
        ExportError, match=r"here: .*trace the equations in line 3 of mine\.py, `if size > 1\.0:`"
    ) as told:
        slopes_of(lambda x, w, p, xp: [mine.drag(x[0], xp)], (1, 1, 1), where="here")(*np.zeros((3, 1)))
    assert "\n" not in str(told.value)
    assert "xp.where instead of if" in str(told.value)


def test_who_calls_our_functions_wrongly_is_named_and_not_we() -> None:
    def crossed(x: Any, w: Any, p: Any, xp: Any) -> list[Any]:
        return [Vector(x[0], x[1], x[2]).cross("up").x]

    with pytest.raises(ExportError, match=r"of test_untraced\.py, `return \[Vector\(x\[0\], x\[1\], x\[2\]\)\.cross"):
        slopes_of(crossed, (3, 1, 1), where="here")(np.zeros(3), *np.zeros((2, 1)))


def test_without_a_place_the_reason_is_told() -> None:
    told = str(untraced(ValueError("no  such\nthing"), "step", "law"))
    assert told.startswith("law: CasADi cannot trace the step: no such thing.")


def test_equations_with_a_branch_are_refused_by_every_verb_that_needs_their_graph() -> None:
    coax = sp.vehicle("coax")
    rates = coax.derivatives

    def branched(state: Any, inputs: Any, parameters: Any, environment: Any, xp: Any) -> Any:
        if state.body.w > 0.0:
            return rates(state, inputs, parameters, environment, xp)
        return rates(state, inputs, parameters, environment, xp)

    mine = replace(coax, derivatives=branched)
    for verb in (sp.trim, sp.linearize):
        with pytest.raises(ExportError, match=r"coax: .*of test_untraced\.py, `if state\.body\.w > 0\.0:`"):
            verb(mine)
