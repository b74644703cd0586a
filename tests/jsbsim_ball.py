"""JSBSim's ball without forces over the WGS 84 Earth, in a process of its own, for it reports on standard output."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from typing import Any

FOOT = 0.3048
_SAID = {
    "latitude": "position/lat-geod-deg",
    "longitude": "position/long-gc-deg",
    "altitude": "position/geod-alt-ft",
    "p": "velocities/pi-rad_sec",
    "q": "velocities/qi-rad_sec",
    "r": "velocities/ri-rad_sec",
    "phi": "attitude/phi-rad",
    "theta": "attitude/theta-rad",
    "psi": "attitude/psi-rad",
    "density": "atmosphere/rho-slugs_ft3",
    "gravity": "accelerations/gravity-ft_sec2",
}


def fly(start: dict[str, float], *, seconds: float, step: float = 0.002) -> dict[str, Any]:
    """What JSBSim says at the start and at the end of a flight from `start` (its initial conditions, in feet and
    degrees)."""
    command = [sys.executable, __file__, json.dumps({"start": start, "seconds": seconds, "step": step})]
    with tempfile.TemporaryDirectory() as folder:  # JSBSim leaves a file where it runs
        said = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder).stdout
    found: dict[str, Any] = json.loads(said.splitlines()[-1])
    return found


def _fly(asked: dict[str, Any]) -> dict[str, Any]:
    import jsbsim

    program = jsbsim.FGFDMExec(None)
    program.set_debug_level(0)
    program.set_dt(asked["step"])
    program.load_model("ball")
    program.disable_output()
    for name, value in asked["start"].items():
        program[f"ic/{name}"] = value
    program.run_ic()

    def now() -> dict[str, float]:
        return {name: program[said] for name, said in _SAID.items()}

    first = now()
    for _ in range(round(asked["seconds"] / asked["step"])):
        program.run()
    return {"first": first, "last": now(), "time": program.get_sim_time(), "version": jsbsim.__version__}


if __name__ == "__main__":
    print("\n" + json.dumps(_fly(json.loads(sys.argv[1]))))
