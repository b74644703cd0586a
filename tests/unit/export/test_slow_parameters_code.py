"""The C of a filter of slow parameters: memory and operations are what is stated, and fit a flight controller."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import swashplate as sp
from counted import COUNTING
from swashplate.filtering.sensor_suite import suite
from swashplate.identification.recursive.slow_parameters import SlowPlan, slow_plan

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
from swashplate.export.slow_parameters_c import slow_parameters_code

BUDGET = 64 * 1024
"""Bytes, and below a share of a Cortex-M7's time at 400 Hz."""
SHARE, MEGAHERTZ = 0.2, 480.0

CALLS = """#define CALL(f) static inline Counted counted_##f(Counted a) { ++operations; return std::f(a.value); }
CALL(sin) CALL(cos) CALL(tan)
static inline Counted counted_atan2(Counted a, Counted b) { ++operations; return std::atan2(a.value, b.value); }
static inline bool operator<=(Counted a, Counted b) { return a.value <= b.value; }
static inline bool operator>=(Counted a, Counted b) { return a.value >= b.value; }
"""
COUNT = """
#include <cstdio>
int main() {
  static Counted inputs[INPUTS], readings[CHANNELS];
  for (int i = 0; i < INPUTS; ++i) inputs[i] = Counted(i + 1 == INPUTS ? 11.1 : 0.4);
  slow_begin();
  slow_step(Counted(0.01), inputs, readings);
  operations = 0;
  int counts = slow_step(Counted(0.01), inputs, readings);
  std::printf("%ld %d %zu %zu", operations, counts, sizeof(slow_memory_t), sizeof(slow_work_t));
}
"""


def plan_of(unknown: tuple[str, ...] = ("mass",)) -> SlowPlan:
    return slow_plan(sp.vehicle("coax"), unknown, sensors=suite("mocap@100+0ms,gyro@100+0ms"), rate=100.0)


@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler")
def test_memory_and_operations_are_those_of_the_code(tmp_path: Path) -> None:
    code = slow_parameters_code(plan_of())
    source = re.sub(r"#include <\w+\.h>", "", code.source)
    source = re.sub(r"(?<![\w])(sin|cos|tan|atan2)\(", r"counted_\1(", source).replace("sqrt(", "counted_root(")
    source = re.sub(r"\bdouble\b", "Counted", source)
    (tmp_path / "count.cpp").write_text(COUNTING + CALLS + source + COUNT)
    made = tmp_path / "count"
    subprocess.run(["g++", "-O0", "-w", "-o", str(made), str(tmp_path / "count.cpp")], check=True)
    ran, counts, memory, work = map(int, subprocess.run([str(made)], capture_output=True, check=True).stdout.split())
    assert counts == 1
    assert (memory, work) == (code.memory_bytes, code.work_bytes)
    # CasADi's instructions are not quite the operations of what it prints; those of the loops are exact.
    assert ran == pytest.approx(code.operations, rel=0.01)


def test_the_coax_fits_a_flight_controller() -> None:
    code = slow_parameters_code(plan_of())
    assert code.memory_bytes + code.work_bytes < BUDGET
    assert code.load(rate=400.0, megahertz=MEGAHERTZ) < SHARE
    more = slow_parameters_code(plan_of(("mass", "tau_f_upper", "linkage_lower", "hub_stiffness_upper")))
    assert more.operations > code.operations
    assert more.memory_bytes + more.work_bytes < BUDGET
