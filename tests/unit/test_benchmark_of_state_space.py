"""The benchmark beside SIPPY: what it says where that package is there, and where it is not."""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from benchmarks import state_space
from scipy.linalg import expm


def test_models_are_judged_by_their_response(monkeypatch: pytest.MonkeyPatch) -> None:
    alone = state_space.against_subspaces(seconds=10.0)
    assert "not installed" in alone.note

    def identified(y: np.ndarray, u: np.ndarray, method: str, **how: float) -> SimpleNamespace:
        """The truth itself, and by one method a gain 10 % too large."""
        assert (y.shape, u.shape) == ((2, 1000), (1, 1000))
        A, B = np.array([[-1.0, 3.0], [-4.0, -2.0]]), np.array([[-2.0], [-10.0]])
        step = expm(np.block([[A, B], [np.zeros((1, 3))]]) * how["tsample"])
        gain = 1.1 if method == "CVA" else 1.0
        return SimpleNamespace(A=step[:2, :2], B=gain * step[:2, 2:], C=np.eye(2), D=np.zeros((2, 1)))

    package = ModuleType("sippy_unipi")
    package.__spec__ = ModuleSpec("sippy_unipi", None)
    package.system_identification = identified  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "sippy_unipi", package)
    beside = state_space.against_subspaces(seconds=10.0)
    shares = [text.split(", ")[-1].split(" %")[0] for text in beside.note.split("SIPPY's ")[1].split("; ")]
    assert shares == ["0.0", "10.0", "0.0"]
    own = float(beside.note.split("response ")[1].split(" %")[0])
    assert 0.1 < own < 40.0  # ten seconds in gusts
