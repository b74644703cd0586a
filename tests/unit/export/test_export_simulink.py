"""The S-function, compiled against our stub of simstruc.h and driven as Simulink's engine would; no MATLAB is here."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.compiler import STRICT, compiler
from swashplate.export.formats import Export, export_model
from swashplate.models.linear.state_space_file import structure
from swashplate.physics.backend import FloatBackend

pytest.importorskip("casadi", reason="the extra 'model' is not installed")
pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

STUBS = Path(__file__).resolve().parents[2] / "stubs"
ENGINE = """
#include <stdio.h>
#include <string.h>
/* The S-function ends in an include; ours is this engine: initialise, then Euler steps of 1 ms for half a second. */
int main(int argc, char **argv) {
  static SimStruct S;
  static real_T heavy[256];
  mxArray parameter;
  int i, k, port;
  (void)argv;
  if (argc > 1) { /* one parameter: the card's numbers, the first of them doubled */
    memcpy(heavy, model_start_p, N_PARAMETERS * sizeof(real_T));
    heavy[0] *= 2;
    parameter.values = heavy;
    parameter.n = argc > 2 ? 3 : N_PARAMETERS;
    S.given_parameters = 1;
    S.parameter[0] = &parameter;
  }
  mdlInitializeSizes(&S);
  if (S.error) {
    printf("%s\\n", S.error);
    return 3;
  }
  mdlInitializeSampleTimes(&S);
  mdlInitializeConditions(&S);
  for (port = 0; port < 2; ++port)
    for (i = 0; i < 64; ++i) S.in_pointers[port][i] = &S.in[port][i];
  for (i = 0; i < S.in_width[0]; ++i) S.in[0][i] = START_U[i] + 0.01;
  for (i = 0; S.inputs > 1 && i < S.in_width[1]; ++i) S.in[1][i] = model_start_s[i];
  for (k = 0; k < 500; ++k) {
    mdlDerivatives(&S);
    for (i = 0; i < S.continuous; ++i) S.x[i] += 0.001 * S.dx[i];
  }
  mdlOutputs(&S, 0);
  for (i = 0; i < S.out_width[0]; ++i) printf("%.17g ", S.out[0][i]);
  for (i = 0; i < S.out_width[1]; ++i) printf("%.17g ", S.out[1][i]);
  mdlTerminate(&S);
  return 0;
}
"""


def built(made: Export, name: str, folder: Path) -> Path:
    made.save(folder)
    (folder / "cg_sfun.h").write_text(f"#define START_U {name}_start_u\n{ENGINE}")
    program = compiler()
    assert program is not None
    command = [
        *program,
        *STRICT,
        "-O0",
        f"-I{STUBS}",
        f"-I{folder}",
        f"{name}_sfun.c",
        f"{name}.c",
        "-lm",
        "-o",
        "engine",
    ]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "engine"


def run(engine: Path, *arguments: str) -> np.ndarray:
    done = subprocess.run([engine, *arguments], capture_output=True, text=True, check=True)
    return np.array(done.stdout.split(), dtype=float)


def test_a_vehicle_flies_in_an_engine_that_steps_it(tmp_path: Path) -> None:
    vehicle = sp.vehicle("coax", bar=False)
    trim = sp.trim(vehicle)
    engine = built(export_model(vehicle, "simulink", name="coax", trim=trim), "coax", tmp_path)
    found = run(engine)
    python, inputs, xp = trim.state, (trim.inputs + 0.01).tolist(), FloatBackend()
    for _ in range(500):  # Euler's steps too
        rates = vehicle.rates(python.tolist(), inputs, vehicle.values(), trim.environment, xp)
        python = python + 0.001 * np.array(rates)
    assert found.size == python.size + 3
    np.testing.assert_allclose(found[:-3], python, rtol=1e-9, atol=1e-9)
    assert np.linalg.norm(found[:-3] - trim.state) > 1.0
    heavy = run(engine, "heavy")  # the first parameter is the mass
    assert heavy[vehicle.index("w")] > found[vehicle.index("w")] + 1.0
    refused = subprocess.run([engine, "heavy", "short"], capture_output=True, text=True, check=False)
    assert (refused.returncode, "one number for each" in refused.stdout) == (3, True)


def test_a_linear_model_has_one_port_in(tmp_path: Path) -> None:
    model = structure("six_dof")
    found = run(built(export_model(model, "simulink", name="six_dof"), "six_dof", tmp_path))
    A, B, C, _ = model.explicit()
    x = np.zeros(8)
    for _ in range(500):
        x = x + 0.001 * (A @ x + B @ np.full(4, 0.01))
    np.testing.assert_allclose(found[:8], x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[8:11], (C @ x)[:3], rtol=1e-9, atol=1e-12)
