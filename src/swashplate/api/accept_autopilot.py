"""A SITL binary of ArduPilot started, flown and judged with a vehicle."""

from __future__ import annotations

import math
import shutil
import socket
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swashplate.api.acceptance import Acceptance
from swashplate.api.asking import name_of, strings
from swashplate.api.link import gains_to_write, link_engine, mapping_of
from swashplate.api.saying import Say
from swashplate.api.truth_beside import Truth, TruthBeside, beside_truth
from swashplate.arrays import Array, Complex
from swashplate.atomic import write_text
from swashplate.control.laws.ardupilot.law import GRAVITY, RATE_OF_LOOPS
from swashplate.control.laws.ardupilot.outputs import CUT_AT_TRIM, HELD, LOGGED, density_gain, output_delays
from swashplate.control.laws.ardupilot.parameters import known
from swashplate.errors import SwashError
from swashplate.extras import library
from swashplate.flights.flight import Flight
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.readers.read import read
from swashplate.links.ardupilot.first_answer import OLDEST_WORDS, naming_the_end, who_it_is
from swashplate.links.ardupilot.gains import ardupilot_law, read_parameter_file
from swashplate.links.ardupilot.mixer_responses import MIXER_AXES, mixed, mixer_response
from swashplate.links.ardupilot.parameters import Parameters, as_written, parameter_file, parameters
from swashplate.links.ardupilot.runner import serve
from swashplate.links.ardupilot.session import ArduPilotSession
from swashplate.links.ardupilot.sitl import Sitl
from swashplate.links.ardupilot.trial import Background, Piloted, Trial, TrialEndedError, TrialLine, TrialPlan
from swashplate.links.ardupilot.trial_parameters import trial_parameters
from swashplate.links.ardupilot.trial_pilot import PLACE, SPEED, TrialPilot
from swashplate.links.ardupilot.trial_sweeps import OF_TWO_MOTORS, RESOLVED, RESOLVED_AT_TRIM, gentle_sweep
from swashplate.links.mavlink.commanding import Commanding
from swashplate.links.mavlink.comparison import compared, rate_problems
from swashplate.links.mavlink.connection import Connection
from swashplate.links.mavlink.greeting import ARDUPILOT, greet
from swashplate.links.mavlink.parameter_reading import ParameterReading, ask_by_name, read_parameters
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.sensing import Sensing
from swashplate.links.sockets import listen_udp
from swashplate.models.vehicle import Vehicle
from swashplate.physics.environment import standard_altitude
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.standing import airborne, standing
from swashplate.simulation.trim import trim

if TYPE_CHECKING:
    from swashplate.api.verbs.link import Accept

_RATE = 100.0
"""Hz of the records: what the System ID mode logs by default."""
_MIXING = ("MOT_", "H_C")
"""What a mixer's parameters begin with."""
_COMPENSATED = ("MOT_BAT_VOLT_MAX", "MOT_BAT_V_MAX")
"""Multicopters' motors and flaps get more where the battery has less."""


def accept_helicopter(asked: Accept, vehicle: Vehicle, say: Say) -> Acceptance:
    """The trial of ArduPilot that was asked for, of a vehicle with its changes.

    First the binary is started beside a vehicle that only stands, and asked who it is: any other program is refused
    before anything is computed. A sweep begins higher than the band where the loops leave less of it than whole
    microseconds resolve. Whatever happens, the binary is ended.
    """
    axes, name = strings(asked.axes), name_of(asked.vehicle)
    defaults = tuple(asked.defaults or ())  # pyrefly: ignore[bad-argument-type]
    band, seconds, instance, timeout = asked.band or (0.4, 8.0), asked.seconds or 40.0, asked.instance, asked.timeout
    if unknown := [axis for axis in axes if axis not in MIXER_AXES]:
        raise SwashError(f"'{unknown[0]}' is none of {', '.join(MIXER_AXES)}.", channel="axes")
    library("pymavlink.dialects.v20.ardupilotmega", what="a trial over MAVLink")
    folder = asked.folder / "sitl"
    if folder.exists():
        raise SwashError("is there already.", where=folder, channel="--out", hint="Give another folder, or remove it.")
    # What can be refused is refused before anything is compiled.
    files = ["trial.parm", "vehicle.parm", *(f"yours-{k + 1}.parm" for k in range(len(defaults)))]
    for file in defaults:
        if not Path(file).is_file():
            raise SwashError("there is no such file.", where=file, channel="defaults")
    called, around = name or vehicle.card.called, asked.around(vehicle)
    above = standard_altitude(float(around.air_density))
    sitl = Sitl(asked.binary, folder, files, instance=instance, speedup=asked.speedup, altitude=above)
    aircraft, flying = standing(vehicle), airborne(vehicle)
    mapping = mapping_of(aircraft, asked.servos, name=name, suffix="")
    say("asking the binary who it is")
    first = Sitl(
        asked.binary, folder.with_name("first-start"), (), instance=instance, speedup=asked.speedup, altitude=above
    )
    version = who_it_is(first, aircraft, mapping, around, timeout=timeout)
    say("trimming and linearising the vehicle")
    level = trim(flying, environment=around)
    model = linearize(flying, level)
    truth = asked.other()
    other = model if truth is None else linearize(airborne(truth), trim(airborne(truth), environment=around))
    yours = {key: value for file in defaults for key, value in read_parameter_file(file).items()}
    mixing = {key: value for key, value in yours.items() if key.startswith(_MIXING)}
    law, expected = ardupilot_law(mapping, flying, level, given=mixing), parameters(mapping, flying, level)
    mixer, names = law.mixer, flying.input_names
    denser = density_gain(law.frame, float(around.air_density))
    moves = {axis: denser * moved for axis, moved in mixed(mixer, level, law.parameters, inputs=names).items()}
    gains: Parameters = {}
    if not any(key.startswith("ATC_RAT_") for key in yours):
        say("searching gains with margins")
        gains = gains_to_write(mapping, flying, level, notice=lambda text: say(text))
    used, pull = {**law.parameters, **gains, **yours}, float(around.gravity)
    at_trim = CUT_AT_TRIM.get(law.frame, ())
    chirps = {
        axis: gentle_sweep(
            model, moves[axis], axis, used, band=band, seconds=seconds, gravity=pull, mapping=mapping,
            least=RESOLVED_AT_TRIM if axis in at_trim else RESOLVED,
            quickest=OF_TWO_MOTORS if law.frame == "two motors" and axis in ("roll", "pitch") else math.inf,
        )
        for axis in axes
    }  # fmt: skip
    shown = next(iter(chirps.values()), Chirp.planned(10, 0.05, band, record=seconds, fade=1.0))
    with listen_udp("127.0.0.1", sitl.physics_port) as bound:
        say("compiling the vehicle")
        plant = Plant(aircraft, mapping, Surroundings(around), engine=link_engine(lambda text: say(text)))
        plant.prepare()
        session = ArduPilotSession(plant, Sensing(plant), Notices(lambda text: say(text)))
        session.prepare()
        _write_files(folder, files, expected | gains, shown, defaults, called)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as radio:
            radio.bind(("127.0.0.1", 0))  # left to itself, the first packet would open a port to every machine
            pilot = TrialPilot(
                lambda pulses: radio.sendto(pulses, ("127.0.0.1", sitl.rc_port)),
                heave=_heave(model, moves["heave"], float(around.gravity)),
                hover_stick=law.hover,
                depth=plant.standing_depth,
            )
            run_up = float(expected.get("H_RSC_RUNUP_TIME", -1.0)) + 1.0
            plan = TrialPlan(chirps, run_up, height=asked.height or 5.0, hover=asked.hover or 10.0, ekf=asked.ekf)
            piloted = Piloted(session, pilot)
            with Background(lambda go_on: serve(bound, piloted, go_on=go_on)) as physics, sitl:
                lines, flown, speed, values = _flown(
                    sitl, session, pilot, plan, expected, timeout=timeout, say=say, physics=physics, version=version
                )
    say("reading the log")
    logs = sitl.logs()
    comparison: TruthBeside | None = None
    if flown:
        loop = values.get("SCHED_LOOP_RATE", RATE_OF_LOOPS)
        late = (HELD + LOGGED) / loop + output_delays("ardupilot", law.frame, len(names), loop)
        mixing = _mixing(values, law.parameters, law.frame)
        moved = {axis: denser * each for axis, each in mixed(mixer, other.trim, mixing, inputs=names).items()}

        def response(linear: LinearModel, axis: str, output: str, omega: Array) -> Complex:
            return mixer_response(linear, moved[axis], output, omega, delay=late, gravity=float(around.gravity))

        swept = {axis: chirps[axis] for axis in flown}
        comparison = _judged(logs, swept, partial(response, other), partial(response, model), loop, pilot, lines)
    log = logs[-1] if logs else None
    return Acceptance(
        str(asked.binary), version, called, tuple(sitl.command), tuple(lines), comparison, log, folder, speed
    )


def _heave(model: LinearModel, moved: Array, gravity: float) -> float:
    """The most acceleration per unit of the collective from 1 to 10 rad/s [m/s^2]: motors come in between."""
    answer = mixer_response(model, moved, "az", np.geomspace(1.0, 10.0, 10), delay=0.0, gravity=gravity)
    return float(np.abs(answer).max())


def _write_files(
    folder: Path, files: Sequence[str], expected: Parameters, chirp: Chirp, yours: Sequence[str | Path], title: str
) -> None:
    folder.mkdir(parents=True)
    trial = trial_parameters(expected, chirp)
    lines = "".join(f"{key},{value:.6g}\n" for key, value in trial.items())
    write_text(folder / files[0], f"# what swash link accept needs beside the vehicle's own\n{lines}")
    write_text(folder / files[1], parameter_file(expected, title=title))
    for place, file in zip(files[2:], yours, strict=True):
        shutil.copyfile(file, folder / place)


def _flown(
    sitl: Sitl,
    session: ArduPilotSession,
    pilot: TrialPilot,
    plan: TrialPlan,
    expected: Parameters,
    *,
    timeout: float,
    say: Say,
    physics: Background,
    version: str,
) -> tuple[list[TrialLine], list[str], float, Mapping[str, float]]:
    """Lines, axes flown, simulated seconds a second, and the parameters that it has.

    Raises:
        LinkError: who answers is no ArduCopter that can be tried, or nobody does.
    """
    say("starting the binary")
    sitl.wait_for_port(timeout)
    with Connection(f"tcp:127.0.0.1:{sitl.mavlink_port}", timeout=timeout) as connection:
        autopilot = Commanding(connection)
        trial = Trial(session, pilot, autopilot, sitl, plan)
        values, begun = dict[str, float](), time.monotonic()
        try:
            with naming_the_end(sitl):
                kind = greet(connection, ARDUPILOT, timeout)
                say("reading the parameters back")
                reading = read_parameters(connection, packed=False)
                ask_by_name(connection, reading, expected, packed=False)
            said = f"{version}, MAVLink type {kind}"
            trial.lines.append(TrialLine("binary", said, f"ArduCopter {OLDEST_WORDS} or later", True))
            values = reading.values
            pilot.lean_max, pilot.keep = _lean_max(reading), _keep(values)
            if _parameters_right(reading, expected, trial.lines):
                trial.fly(say)
        except TrialEndedError as error:
            trial.lines.append(TrialLine("flight", str(error), "to its end", False))
        if physics.failed:
            trial.lines.append(TrialLine("physics", str(physics.failed[0]), "answers to the end", False))
        wall = time.monotonic() - begun
    return trial.lines, trial.swept_axes, session.plant.time / max(wall, 1e-9), values


def _lean_max(reading: ParameterReading) -> float:
    """Lean at a full stick [rad]: ANGLE_MAX in hundredths of a degree, ATC_ANGLE_MAX of Copter 4.7 in degrees."""
    values = reading.values
    degrees = values["ANGLE_MAX"] / 100.0 if "ANGLE_MAX" in values else values.get("ATC_ANGLE_MAX", 30.0)
    return math.radians(degrees)


def _keep(values: Mapping[str, float]) -> tuple[float, float]:
    """Lean per m and m/s of the pilot [rad]: no more than the autopilot's own, which are slow where a vehicle is."""
    own = known({name: value for name, value in values.items() if name.startswith("PSC_")}, frame="swashplate")
    speed = min(SPEED, own["PSC_VELXY_P"] / GRAVITY)
    return min(PLACE, own["PSC_POSXY_P"] * speed), speed


def _mixing(values: Mapping[str, float], planned: Mapping[str, float], frame: str) -> Parameters:
    """The parameters that the mixer reads, as the autopilot had them; the others as planned."""
    told = {name: value for name, value in values.items() if name.startswith(_MIXING)}
    return {**planned, **{name: known(told, frame=frame)[name] for name in told if name in planned}}


def _parameters_right(reading: ParameterReading, expected: Parameters, lines: list[TrialLine]) -> bool:
    rows = compared(as_written(expected), reading)
    bad = [row.problem for row in rows if row.problem] + rate_problems(reading.values)
    bad += [
        f"{name} is {reading.values[name]:g}, expected 0: the truth beside the estimate knows no such compensation."
        for name in _COMPENSATED
        if reading.values.get(name, 0.0) > 0.0
    ]
    if not reading.complete:
        bad.append(f"{len(reading.missing)} of {reading.count} never came")
    words = " ".join(bad) or f"{len(rows)} as the vehicle needs them"
    lines.append(TrialLine("parameters read back", words, "as the vehicle needs them", not bad))
    return not bad


def _judged(
    logs: Sequence[Path],
    flown: Mapping[str, Chirp],
    true: Truth,
    own: Truth,
    loop: float,
    pilot: TrialPilot,
    lines: list[TrialLine],
) -> TruthBeside | None:
    """The estimates of the newest log; lines are added for the log and for each of them."""
    if not logs:
        lines.append(TrialLine("log", "none was written", "one in logs/", False))
        return None
    try:
        flight = read(logs[-1])
        damage = "; ".join(flight.provenance.damage)
        lines.append(TrialLine("log", damage or f"{flight.duration:.0f} s", "read, not damaged", not damage))
        lines.append(_rotor_line(flight, pilot))
        comparison = beside_truth(flight, flown, true, own, rate=_RATE, loop=loop)
    except SwashError as error:
        lines.append(TrialLine("log", str(error), "read", False))
        return None
    lines += comparison.lines
    return comparison


def _rotor_line(flight: Flight, pilot: TrialPilot) -> TrialLine:
    """The rotor speed that the log has, beside the true one; told, not judged: not every version reads it."""
    true = float(np.max([seen.rotor for seen in pilot.looks])) * 30.0 / math.pi
    logged = float(np.max(flight.values("omega_rotor"))) * 30.0 / math.pi if "omega_rotor" in flight else 0.0
    words = f"{logged:.0f} rpm" if logged else "none: this version reads no rpm, or RPM1_TYPE is not 10"
    return TrialLine("rotor speed in the log, largest", words, f"{true:.0f} rpm")
