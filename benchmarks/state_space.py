"""A linear state-space model from one record in gusts, beside SIPPY's subspace methods where that package is there."""

from __future__ import annotations

import contextlib
import io
import time
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.linalg import expm

from benchmarks.timing import Span
from swashplate.arrays import Array
from swashplate.flights.flight import Flight, stream
from swashplate.identification.identify import identify
from swashplate.models.linear.state_space_file import parse

SECONDS, RATE, WITHIN = 60.0, 100.0, 5.0
_METHODS = ("N4SID", "CVA", "PARSIM-K")
_A, _B = np.array([[-1.0, 3.0], [-4.0, -2.0]]), np.array([[-2.0], [-10.0]])
_BAND = 2.0 * np.pi * np.geomspace(0.2, 2.0, 30)
_MODEL = """
kind = "state-space"
name = "short period"
[states]
w = "m/s"
q = "rad/s"
[inputs]
elevator = "rad"
[equations]
w = {w = "Zw", q = "Zq", elevator = "Zd"}
q = {w = "Mw", q = "Mq", elevator = "Md"}
[outputs.w]
of = {w = "1"}
[outputs.q]
of = {q = "1"}
[parameters]
Zw = {value = -1.3}
Zq = {value = 2.1}
Zd = {value = -2.6}
Mw = {value = -2.8}
Mq = {value = -2.6}
Md = {value = -7.0}
"""


def record(seconds: float = SECONDS) -> tuple[Array, Array, Array]:
    """Time, elevator (n,) and the measured w and q (n, 2): a multisine of 0.2 to 2 Hz in gusts, with sensor noise."""
    random, step = np.random.default_rng(5), expm(np.block([[_A, _B], [np.zeros((1, 3))]]) / RATE)
    t = np.arange(round(seconds * RATE)) / RATE
    elevator = sum(0.05 * np.sin(2.0 * np.pi * f * t + 7.0 * f * f) for f in np.arange(0.2, 2.01, 0.2))
    x, rows = np.zeros(2), []
    for u in elevator:
        rows.append(x)
        x = step[:2, :2] @ x + step[:2, 2] * u + 0.02 * random.standard_normal(2)
    return t, np.asarray(elevator), np.array(rows) + 0.02 * random.standard_normal((t.size, 2))


def against_subspaces(*, seconds: float = SECONDS) -> Span:
    """Maximum likelihood in gusts, start values 30 % off, beside three subspace methods that are told the order.

    Both are judged by the response of w and q to the elevator over the multisine's band: the largest error relative to
    the largest response of that output. SIPPY's models are of samples, and are judged as such.
    """
    t, elevator, measured = record(seconds)
    flight = Flight({"uniform": stream(t, {"w": measured[:, 0], "q": measured[:, 1], "elevator": elevator})})
    begin = time.process_time()
    fit = identify(parse(_MODEL), flight, shifts=False, method="filter-error")
    ours = time.process_time() - begin
    values = {e.name: e.value for e in fit.estimates}
    A = np.array([[values["Zw"], values["Zq"]], [values["Mw"], values["Mq"]]])
    B = np.array([[values["Zd"]], [values["Md"]]])
    note = f"processor time, compiling included; largest error of the response {100 * _error(A, B, np.eye(2)):.1f} %"
    name = f"state-space model of {len(values)} parameters, {seconds:g} s in gusts"
    if find_spec("sippy_unipi") is None:
        return Span(name, ours, WITHIN, f"{note}; SIPPY (sippy-unipi) is not installed: not compared")
    told = [_subspace(method, elevator, measured) for method in _METHODS]
    return Span(name, ours, WITHIN, f"{note}; SIPPY's {'; '.join(told)}")


def _subspace(method: str, elevator: Array, measured: Array) -> str:
    package: Any = import_module("sippy_unipi")
    begin = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):
        made = package.system_identification(measured.T, elevator[None], method, SS_fixed_order=2, tsample=1.0 / RATE)
    seconds = time.process_time() - begin
    z = np.exp(1j * _BAND / RATE)
    response = np.array([made.C @ np.linalg.solve(s * np.eye(2) - made.A, made.B) + made.D for s in z])[:, :, 0]
    return f"{method} {seconds:.2f} s, {100 * _apart(response):.1f} %"


def _error(A: Array, B: Array, C: Array) -> float:
    return _apart(_held(A, B, C))


def _held(A: Array, B: Array, C: Array) -> Array:
    """The response of the sampled system to an input that is held between samples, (frequencies, outputs)."""
    n = len(A)
    step = expm(np.block([[A, B], [np.zeros((1, n + 1))]]) / RATE)
    z = np.exp(1j * _BAND / RATE)
    return np.array([C @ np.linalg.solve(s * np.eye(n) - step[:n, :n], step[:n, n:]) for s in z])[:, :, 0]


def _apart(response: Array) -> float:
    true = _held(_A, _B, np.eye(2))
    return float(np.max(np.abs(response - true) / np.abs(true).max(axis=0)))
