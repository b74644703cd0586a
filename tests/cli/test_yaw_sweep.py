"""A yaw sweep in ArduPilot's System ID mode, from the log to a model and gains, one command each."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from commands import swash

from made_autopilot_logs import Row, dataflash
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp

CHIRP = Chirp(axis=12, magnitude=0.1, start_hz=0.15, stop_hz=8.0, record=40.0, fade_in=2.0, fade_out=1.0, dwell=13.0)
DAMPING, EFFECT, DELAY = 1.2, 25.0, 0.05
FLOWN = {"P": 0.18, "I": 0.018, "D": 0.0, "FF": 0.0, "FLTE": 20.0, "FLTD": 0.0}


def flown(path: Path) -> Path:
    """A tail rotor with a lag of DELAY, in the rate loop with its error filter, at 400 Hz; logged at 50 Hz."""
    dt, begin = 1.0 / 400.0, 10.0
    times = begin + np.arange(round(44.0 / dt)) * dt
    chirp, frequency = CHIRP.signal(times - begin - 2.0), CHIRP.frequency(times - begin - 2.0)
    gusts = 0.02 * np.sqrt(dt) * np.random.default_rng(3).standard_normal(times.size)
    sensor = 0.05 * np.random.default_rng(4).standard_normal(times.size)

    def us(t: float) -> int:
        return round(1e6 * t)

    rows: list[Row] = [("MSG", (us(begin), "ArduCopter V4.7.0-dev (1234abcd)")), ("EV", (us(begin), 10))]
    rows += [("PARM", (us(begin), f"ATC_RAT_YAW_{name}", value, 0.0)) for name, value in FLOWN.items()]
    c = CHIRP
    sids = (c.axis, c.magnitude, c.start_hz, c.stop_hz, c.fade_in, c.dwell, c.record, c.fade_out)
    rows.append(("SIDS", (us(begin + 1.0), *sids)))
    r = total = error = 0.0
    late = [0.0] * round(DELAY / dt)
    share = dt / (dt + 1.0 / (2.0 * np.pi * FLOWN["FLTE"]))
    for k, (t, x, gust) in enumerate(zip(times.tolist(), chirp.tolist(), gusts.tolist(), strict=True)):
        error += (-r - error) * share
        total += FLOWN["I"] * error * dt
        out = FLOWN["P"] * error + total + x
        late.append(out)
        r += dt * (EFFECT * late.pop(0) - DAMPING * r) + gust
        if k % 8 == 0:
            seen = float(np.degrees(r) + sensor[k])
            rows.append(("RATE", (us(t), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, seen, out, 0.0, 0.0, 0.5)))
            rows.append(("SIDD", (us(t), t - begin - 1.0, x, float(frequency[k]), 0.0, 0.0, seen, 0.0, 0.0, -9.8)))
    rows.append(("EV", (us(times[-1]), 11)))
    path.write_bytes(dataflash(rows))
    return path


def test_from_a_yaw_sweep_to_gains(tmp_path: Path) -> None:
    log, responses = flown(tmp_path / "yaw.bin"), tmp_path / "responses"
    assert "yaw mixer: 12.00 to 52.00 s, 0.15 to 8 Hz (as the log says)" in swash("inspect", log).out
    asked = ("--inputs", "mixer_yaw", "--outputs", "r", "--references", "sid_target")
    done = swash("respond", log, *asked, "--out", responses)
    assert done.code == 0, done.err
    done = swash("identify", "--structure", "yaw", "--responses", responses, "--gains", "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    found = {p["name"]: p["value"] for p in document["fit"]["estimates"]}
    assert found["Nr"] == pytest.approx(-DAMPING, rel=0.05)
    assert found["Nped"] == pytest.approx(EFFECT, rel=0.03)
    assert found["tau_yaw"] == pytest.approx(DELAY - 0.5 / 400.0, abs=0.002)  # a step acts at once, half a step early
    (yaw,) = document["gains"]
    assert yaw["flown"] == pytest.approx({f"ATC_RAT_YAW_{name}": value for name, value in FLOWN.items()})
    # By hand: the flown loop's phase is -180 degrees where delay, filter and lag take 90 beyond the rate's own.
    at = yaw["flown_margins"]["omega_180"][0]
    turned = at * found["tau_yaw"] + np.arctan(at / (40.0 * np.pi)) + np.arctan(at / DAMPING) + np.arctan(0.1 / at)
    assert np.degrees(turned) == pytest.approx(180.0, abs=1.0)
    assert yaw["parameters"]["ATC_RAT_YAW_FF"] == pytest.approx(DAMPING / EFFECT, rel=0.06)
