"""JSBSim's helicopter in the same run: its own aircraft, its own flight script."""

from __future__ import annotations

import json
import subprocess
import sys
import time

from benchmarks.timing import Result


def jsbsim_ah1s(*, steps: int, repeats: int) -> Result:
    """Steps per second of JSBSim's `ah1s` under `scripts/ah1s_flight_test.xml` (both come with its package).

    In a process of its own, because JSBSim reports on standard output.
    """
    command = [sys.executable, "-m", "benchmarks.peers", str(steps), str(repeats)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    measured = json.loads(said.splitlines()[-1])
    return Result("JSBSim ah1s", measured["rate"], None, f"version {measured['version']}, its own script and step")


def _measure(steps: int, repeats: int) -> dict[str, object]:
    import jsbsim

    rate = 0.0
    for _ in range(repeats):
        program = jsbsim.FGFDMExec(None)
        program.set_debug_level(0)
        program.load_script("scripts/ah1s_flight_test.xml")
        program.disable_output()
        program.run_ic()
        begin, done = time.perf_counter(), 0
        while done < steps and program.run():
            done += 1
        rate = max(rate, done / (time.perf_counter() - begin))
    return {"rate": rate, "version": jsbsim.__version__}


if __name__ == "__main__":
    print("\n" + json.dumps(_measure(int(sys.argv[1]), int(sys.argv[2]))))
