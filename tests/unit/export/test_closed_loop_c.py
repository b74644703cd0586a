"""Where flights in C are not to be had. That they are XLA's flights is asked where XLA flies the same: with sensors in
`filtering/test_batched_matrices`, with late commands in `control/analysis/test_late_commands`."""

from __future__ import annotations

import pytest

import swashplate as sp
from swashplate.control.laws.hold import hover_hold
from swashplate.control.lqg.design import design
from swashplate.export import closed_loop_c
from swashplate.export.closed_loop_c import loop_in_c


def test_a_law_without_c_and_a_machine_without_a_compiler_leave_it_to_xla(monkeypatch: pytest.MonkeyPatch) -> None:
    coax = sp.vehicle("coax")
    hover = sp.trim(coax)
    assert loop_in_c(coax, hover_hold(coax, hover), hover) is None
    monkeypatch.setattr(closed_loop_c, "can_compile", lambda: False)
    assert loop_in_c(coax, design(coax, sensors=()), hover) is None
