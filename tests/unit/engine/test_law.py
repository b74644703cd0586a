"""A law's code is printed, or it is said that it cannot be."""

from __future__ import annotations

from pathlib import Path

import casadi
import pytest

from swashplate.engine.law import print_function
from swashplate.errors import WriteError


def test_a_disk_that_takes_no_code_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Found by the siege's failing disks: CasADi raises an error of its own."""
    x = casadi.SX.sym("x", 2)
    function = casadi.Function("f", [x], [casadi.sin(x)])
    text, calls = print_function(function, "double")
    assert "f(" in text
    assert calls["sin"] > 0
    generate = casadi.CodeGenerator.generate

    def in_the_way(self: casadi.CodeGenerator, folder: str) -> str:
        Path(f"{folder}traced.c").mkdir()
        return generate(self, folder)

    monkeypatch.setattr(casadi.CodeGenerator, "generate", in_the_way)
    with pytest.raises(WriteError, match="CasADi's code cannot be written there"):
        print_function(function, "double")
