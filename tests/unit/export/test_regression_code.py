"""The C of a recursive regression: the same numbers as Python's, and the memory and operations that are stated."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from counted import COUNTING
from swashplate.compiler import compiler, shared_library
from swashplate.export.regression_c import RegressionCode, regression_code
from swashplate.identification.recursive.equation import regression_equation
from swashplate.identification.recursive.fourier_regression import RecursiveRegression, RegressionPlan, regression_plan

needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")
SIZES = """#include "regression.h"
int memory_size(void); int work_size(void);
int memory_size(void) { return (int)sizeof(regression_memory); }
int work_size(void) { return (int)sizeof(regression_work); }
"""
COUNT = """
#include <cstdio>
#include <cstdlib>
int main() {
  static regression_memory e;
  static regression_work w;
  static Counted sample[CHANNELS], values[UNKNOWNS], covariance[UNKNOWNS][UNKNOWNS];
  long step = 0;
  regression_begin(&e);
  for (int n = 0; n < 900; ++n) {
    for (int i = 0; i < CHANNELS; ++i) sample[i] = Counted(std::rand() / 1e9);
    operations = 0;
    regression_step(&e, Counted(0.01), sample);
    step = operations > step ? operations : step;
  }
  operations = 0;
  int told = regression_estimate(&e, &w, values, covariance);
  std::printf("%ld %ld %d", step, operations, told);
}
"""


def plan_of(text: str = "q_dot = Mw*w + Mq*q + Md*elevator - 2.5*p + bias") -> RegressionPlan:
    e = regression_equation(text, delays={"elevator": 0.02} if "elevator" in text else {})
    return regression_plan(
        e, rate=100, band=(0.1, 2.0), spacing=0.1, memory=8.0, held=["elevator"] * ("elevator" in text)
    )


class Compiled:
    """The C on rows of numbers."""

    def __init__(self, code: RegressionCode, unknowns: int, folder: Path, real: type = ctypes.c_double) -> None:
        for name, text in {**code.files(), "sizes.c": SIZES}.items():
            (folder / name).write_text(text)
        sources = [folder / "regression.c", folder / "sizes.c"]
        options = ["-pedantic", "-Wconversion", "-ffp-contract=off"]
        self.library = ctypes.CDLL(str(shared_library(sources, folder / "made.so", options=options)))
        self.sizes = self.library.memory_size(), self.library.work_size()
        self._memory, self._work = (ctypes.create_string_buffer(size) for size in self.sizes)
        self._unknowns, self._real = unknowns, real
        self.library.regression_begin(self._memory)

    def step(self, elapsed: float, sample: np.ndarray) -> bool:
        row = (self._real * len(sample))(*sample)
        return bool(self.library.regression_step(self._memory, self._real(elapsed), row))

    def estimate(self) -> tuple[np.ndarray, np.ndarray] | None:
        k = self._unknowns
        values, covariance = (self._real * k)(), (self._real * (k * k))()
        if not self.library.regression_estimate(self._memory, self._work, values, covariance):
            return None
        return np.array(values, dtype=float), np.array(covariance, dtype=float).reshape(k, k)


def worst(plan: RegressionPlan, compiled: Compiled, steps: int) -> float:
    """Largest difference from Python over a stream with gaps, values that are none and clocks that jump."""
    random, regression, found, told = np.random.default_rng(0), RecursiveRegression(plan), 0.0, set()
    state = np.zeros(len(plan.equation.channels))
    for i in range(steps):
        state = 0.97 * state + random.standard_normal(state.size)
        sample, elapsed = state.copy(), plan.dt * (1.0 + 0.01 * random.standard_normal())
        sample[0] = np.sin(0.05 * i) + 0.1 * state[0]
        sample[1] = {500: np.nan, 800: np.inf}.get(i % 1001, sample[1])
        elapsed = {601: 0.5, 703: -3.0, 705: np.nan, 707: 0.0}.get(i % 1001, elapsed)
        assert compiled.step(elapsed, sample) == regression.step(elapsed, sample)
        if i % 37 == 0:
            mine, its = regression.estimate(), compiled.estimate()
            assert (mine is None) == (its is None)
            told.add(mine is None)
            if mine is not None and its is not None and mine.covariance is not None:
                scale = np.outer(mine.sigmas, mine.sigmas)
                size = np.maximum(np.abs(mine.values), mine.sigmas)
                found = max(found, float(np.max(np.abs(its[0] - mine.values) / size)))
                found = max(found, float(np.max(np.abs(its[1] - mine.covariance) / scale)))
    assert told == {True, False}
    return found


@needs_compiler
@pytest.mark.parametrize("text", ["q_dot = Mw*w + Mq*q + Md*elevator - 2.5*p + bias", "az = Zw*w"])
def test_the_c_is_the_python_to_rounding(text: str, tmp_path: Path) -> None:
    plan = plan_of(text)
    code = regression_code(plan)
    compiled = Compiled(code, len(plan.equation.names), tmp_path)
    assert worst(plan, compiled, 1500) < 1e-12
    assert compiled.sizes == (code.memory_bytes, code.work_bytes)


@needs_compiler
def test_in_single_precision_it_keeps_three_digits(tmp_path: Path) -> None:
    plan = plan_of()
    code = regression_code(plan, precision="single")
    compiled = Compiled(code, len(plan.equation.names), tmp_path, ctypes.c_float)
    assert worst(plan, compiled, 1500) < 1e-3
    assert compiled.sizes[0] <= code.memory_bytes
    assert compiled.sizes[1] == code.work_bytes
    assert not re.search(r"(?<![\w])double(?![\w])", code.source + code.header)


@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler")
@pytest.mark.parametrize("text", ["q_dot = Mw*w + Mq*q + Md*elevator - 2.5*p + bias", "az = Zw*w"])
def test_operations_are_those_that_run(text: str, tmp_path: Path) -> None:
    code = regression_code(plan_of(text))
    header = re.sub(r"\bdouble\b", "Counted", code.header)
    source = re.sub(r"\bdouble\b", "Counted", code.source).replace("#define SQRT sqrt", "#define SQRT counted_root")
    source = source.replace('#include "regression.h"', header)
    (tmp_path / "count.cpp").write_text(COUNTING + source + COUNT)
    made = tmp_path / "count"
    subprocess.run(["g++", "-O0", "-o", str(made), str(tmp_path / "count.cpp")], check=True)
    step, estimate, told = map(int, subprocess.run([str(made)], capture_output=True, check=True).stdout.split())
    assert told
    assert (step, estimate) == (code.step_operations, code.estimate_operations)


def test_it_fits_a_flight_controller_and_allocates_nothing() -> None:
    code = regression_code(plan_of())
    body = re.sub(r"(?m)^#.*$", "", re.sub(r"(?s)/\*.*?\*/", "", code.source))
    called = set(re.findall(r"(?<![\w])([a-z_]\w*)\(", body)) - {"for", "if", "return"}
    assert {name for name in called if "regression" not in name} == {"turn", "transform", "rows", "inverted"}
    assert "SQRT" in set(re.findall(r"(?<![\w])([A-Z]+)\(", body))
    assert set(re.findall(r"#include <(\w+)", code.source)) == {"math"}
    assert code.memory_bytes + code.work_bytes + code.table_bytes < 64 * 1024
    assert code.load(rate=400.0, megahertz=216.0, every=20) < 0.2
    assert code.load(rate=400.0, megahertz=216.0, every=20) > code.load(rate=400.0, megahertz=480.0, every=20)
