"""Golden cases over frequencies: genuine sweeps, an R-50 from its published model, responses to transfer functions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import swashplate as sp
from swashplate.identification.frequency.state_space_fit import fit_state_space
from swashplate.validation.verify import verify

from . import extract
from .case import Values, case, named
from .cases_flights import data
from .inner import Flight, Provenance, as_state_space, stream, suggest, suggest_gains, verify_inside

MIXER, RATES = ("mixer_roll", "mixer_pitch"), ("p", "q")


def sitl(name: str, *channels: str) -> Any:
    """The streams of a genuine ArduPilot log that hold some channels, at 100 Hz."""
    log = sp.read(data() / "ardupilot_sitl" / name)
    homes = {log.stream_of(channel) for channel in channels}
    log = log.with_streams({key: data for key, data in log.streams.items() if key in homes})
    return log.condition(rate=100, cutoff=0, outliers=False, trim_ground=False, derive=False)


@case(data=["ardupilot_sitl"])
def ardupilot_rates(folder: Path) -> Values:
    """Roll and pitch sweeps: responses, rotor-body model, gains, an unseen log in time, and a fit in time."""
    sweeps = [sitl(f"heli_sid_{axis}_mix.BIN", *MIXER, *RATES) for axis in ("roll", "pitch")]
    responses = sp.respond(sweeps, inputs=MIXER, outputs=RATES, band=(0.1, 16.0))
    fit = fit_state_space(sp.structure("rotor_body"), responses)
    unseen = sitl("heli_sid_allbits_roll_rate.BIN", *MIXER, *RATES)
    found = named("response", extract.of_responses(responses)) | named("model", extract.of_state_space_fit(fit))
    for s in suggest_gains(fit.solution):
        found |= {f"gain.{name}": float(value) for name, value in s.parameters.items()}
    found |= named("verify", extract.of_verification(verify(fit.solution, unseen)))
    in_time = sp.identify(fit.solution, unseen, iterations=20)
    return found | named("time", extract.of_time_fit(in_time))


@case(light=True, data=["ardupilot_sitl"])
def ardupilot_heave(folder: Path) -> Values:
    """The collective sweep: response and transfer functions."""
    log = sitl("heli_sid_coll_mix.BIN", "mixer_collective", "az_sid")
    responses = sp.respond(log, inputs=["mixer_collective"], outputs=["az_sid"], band=(0.15, 8.0))
    fit = sp.fit_transfer_function(responses, "0/1-1s", input="mixer_collective", band=(0.15, 7.0))
    found = named("response", extract.of_responses(responses, most=12))
    return found | named("fit", extract.of_transfer_function(fit))


def x8(part: slice) -> Any:
    """A part of the X8 multirotor's roll record."""
    rows = np.loadtxt(data() / "x8" / "x8roll.csv", delimiter=",")[part]
    columns = {"command": rows[:, 1], "p": np.radians(rows[:, 2])}
    return Flight({"uniform": stream(np.arange(len(rows)) / 100.0, columns, {"command": "1"})}, Provenance("x8roll"))


@case(light=True, data=["x8"])
def x8_roll(folder: Path) -> Values:
    """Responses of the whole record, a model of one half, and how it does on the other."""
    whole = x8(slice(None))
    n = len(whole.values("p"))
    responses = sp.respond(whole, inputs=["command"], outputs=["p"], band=(0.1, 10.0))
    late = sp.respond(x8(slice(n // 2, n)), inputs=["command"], outputs=["p"], band=(0.2, 10.0))
    fit = sp.fit_transfer_function(late, "0/2", input="command", band=(0.7, 8.7))
    verified = verify_inside(as_state_space(fit), x8(slice(0, n // 2)), band=(0.7, 8.7))
    found = named("response", extract.of_responses(responses, most=12))
    found |= named("fit", extract.of_transfer_function(fit)) | named("verify", extract.of_verification(verified))
    return found | named("inside", extract.of_verification(verified.inside))


@case(data=["x8"])
def x8_suggested(folder: Path) -> Values:
    """The usual structures tried on the X8's response."""
    responses = sp.respond(x8(slice(None)), inputs=["command"], outputs=["p"], band=(0.1, 10.0))
    found: Values = {}
    for trial in suggest(responses, input="command", band=(0.7, 8.7))[1]:
        found |= named(trial.form.text, {"cost": trial.cost, "parameters": float(trial.parameters)})
    return found


@case(data=["trex550", "sidpac"])
def sweeps_of_others(folder: Path) -> Values:
    """A T-Rex 550 with an autopilot in the loop, and SIDPAC's example in the frequency domain."""
    from scipy import io

    rows = np.genfromtxt(data() / "trex550" / "trex550_flight.csv", delimiter=",", names=True)
    sticks = [name for name in rows.dtype.names if name.startswith("stick")]
    columns = {name: rows[name] for name in (*sticks, "p", "q", "r")}
    time = np.arange(len(rows)) * 0.0082
    flight = Flight({"uniform": stream(time, columns, dict.fromkeys(sticks, "1"))}, Provenance("trex550"))
    responses = sp.respond(flight, inputs=sticks, outputs=["p", "q", "r"], band=(0.1, 6.0))
    found = named("trex", extract.of_responses(responses, most=4))
    table = io.loadmat(data() / "sidpac" / "fdoe_example.mat")
    signals = {"stick": table["u"].ravel(), "out": table["z"].ravel()}
    flight = Flight({"uniform": stream(table["t"].ravel(), signals, {"stick": "1"})})
    responses = sp.respond(flight, inputs=["stick"], outputs=["out"], band=(0.02, 1.0), windows=[80.0, 40.0, 20.0])
    fit = sp.fit_transfer_function(responses, "1/2", input="stick")
    return found | named("sidpac", extract.of_transfer_function(fit))


@case(data=["vehicle", "list"])
def r50_from_sweeps(folder: Path) -> Values:
    """Published hover derivatives of an R-50 flown in a loop in gusts, identified from its sweeps, 13 states."""
    import r50

    truth = r50.truth(data())
    sweeps = [r50.fly(truth, axis, seed=number) for number, axis in enumerate(truth.inputs)]
    how = {"inputs": truth.inputs, "outputs": truth.outputs, "band": (0.05, 6.0)}
    responses = sp.respond(sweeps, references=["sweep"], **how)
    random = np.random.default_rng(1)
    off = {n: truth.parameters[n].value * (1.0 + 0.3 * random.choice([-1.0, 1.0])) for n in truth.free}
    fit = fit_state_space(truth.with_values(off), responses)
    unseen = verify(fit.solution, r50.fly(truth, "lateral", seed=99, seconds=30.0), outputs=["p", "q", "r"])
    found = named("response", extract.of_responses(responses, most=3)) | named("fit", extract.of_state_space_fit(fit))
    return found | named("verify", extract.of_verification(unseen))


@case()
def coax_sweeps_on_the_command_line(folder: Path) -> Values:
    """Simulated sweeps of the CoaX: respond, fit-tf with margins, the coaxial structure reduced."""
    from .extract import swash, swash_json

    for axis in ("roll", "pitch"):
        what = f"sweep:{axis},0.3-8Hz,40s,0.1"
        swash("simulate", "--vehicle", "coax", "--maneuver", what, "--out", folder / f"{axis}.nc", "-q")
    logs, out = (folder / "roll.nc", folder / "pitch.nc"), folder / "responses"
    given = ("--inputs", "servo_roll,servo_pitch", "--outputs", "p,q", "--band", "0.1-8")
    swash("respond", *logs, *given, "--out", out, "-q")
    how = ("--input", "servo_pitch", "--outputs", "q", "--form", "1/3", "--band", "0.2-8", "--margins")
    found = named("tf", numbers(swash_json("identify", "--responses", out, *how)))
    how = ("--band", "0.3-8", "--settings", "starts=1", "--settings", "reduce=true")
    return found | named("ss", numbers(swash_json("identify", "--structure", "coaxial", "--responses", out, *how), 6))


def numbers(document: Any, most: int = 12) -> Values:
    """What is a number in a JSON document, at most 150 entries."""
    entries = {k: v for k, v in extract.of_json(document, most=most).items() if isinstance(v, float | list)}
    return dict(list(entries.items())[:150])
