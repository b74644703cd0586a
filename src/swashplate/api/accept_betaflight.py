"""A SITL binary of Betaflight started, flown and judged with a multirotor."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swashplate.api.acceptance import Acceptance
from swashplate.api.asking import name_of, strings
from swashplate.api.link import link_engine
from swashplate.api.saying import Say
from swashplate.api.truth_beside import GAIN, PHASE, SIGMAS, TruthBeside, gain_and_phase_off
from swashplate.arrays import Array
from swashplate.errors import SwashError
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.flights.readers.read import read
from swashplate.identification.responses.respond import respond
from swashplate.links.ardupilot.mixer_responses import MIXER_AXES
from swashplate.links.ardupilot.trial import Background, TrialEndedError, TrialLine
from swashplate.links.betaflight.binary import BetaflightBinary
from swashplate.links.betaflight.configuration import configuration, read_settings
from swashplate.links.betaflight.flown_loop import flown_loop
from swashplate.links.betaflight.gains import AXES, RATES, SIGNS, axis_response, betaflight_gains
from swashplate.links.betaflight.log_clock import log_clock
from swashplate.links.betaflight.motors import MotorMapping
from swashplate.links.betaflight.packets import MOTORS_PORT, STATE_SIZE
from swashplate.links.betaflight.pilot import pilot_for
from swashplate.links.betaflight.session import BetaflightSession, serve
from swashplate.links.betaflight.stepped_clock import LOOP, stepped_clock
from swashplate.links.betaflight.trial import BetaflightTrial, StickSweep
from swashplate.links.notices import Notices
from swashplate.links.plant import Plant, Surroundings
from swashplate.links.sensing import Sensing
from swashplate.links.sockets import listen_udp
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.standing import airborne, standing
from swashplate.simulation.trim import trim

if TYPE_CHECKING:
    from swashplate.api.verbs.link import Accept

_PACE = 0.25
"""Simulated seconds a second without lockstep, where nothing slower is asked for."""
_RATE = 200.0
"""Hz of the records."""
_COHERENT, _LEAST_SHARE = 0.8, 0.5
"""Coherence from which on a line counts, and the share of the band that must have it to be judged."""


def accept_multirotor(
    asked: Accept, vehicle: Vehicle, say: Say, *, gains: Mapping[str, float] | None = None
) -> Acceptance:
    """The trial of Betaflight that was asked for, of a vehicle with its changes.

    It is configured (motors, modes, gains with margins), started, armed, hovered in ANGLE mode by a pilot of ours, and
    each stick is swept; then the response of its Blackbox log is held against the vehicle's linearisation. Where its
    clock cannot be brought into lockstep with the physics, both run slowly, so that a busy machine is not late. The
    binary is ended in every case.

    Args:
        gains: settings of Betaflight's command line that are flown; those of `betaflight_gains` where None.
    """
    axes = tuple(axis for axis in strings(asked.axes) if axis != "heave" or asked.axes != tuple(MIXER_AXES))
    timeout, truth = asked.timeout, asked.other()
    band, seconds = asked.band or (0.5, 6.0), asked.seconds or 20.0
    if unknown := [axis for axis in axes if axis not in AXES]:
        raise SwashError(f"'{unknown[0]}' is none of {', '.join(AXES)}.", channel="axes")
    folder = asked.folder / "sitl"
    if folder.exists():
        raise SwashError("is there already.", where=folder, channel="--out", hint="Give another folder, or remove it.")
    if gains is None and asked.defaults:
        files = [asked.defaults] if isinstance(asked.defaults, str | Path) else asked.defaults
        gains = {name: value for file in files for name, value in read_settings(file).items()}
    mapping, sitl = MotorMapping(vehicle), BetaflightBinary(asked.binary, folder)
    around = asked.around(vehicle)
    with listen_udp("127.0.0.1", MOTORS_PORT) as bound:
        say("asking the binary who it is")
        sitl.configure(configuration(mapping, gains or {}), timeout=timeout)
        clock = sitl.before = stepped_clock(STATE_SIZE, folder)
        say("trimming and linearising the vehicle")
        flying = airborne(vehicle)
        model = linearize(flying, trim(flying, environment=around))
        say("searching gains with margins")
        settings = dict(gains) if gains is not None else dict(betaflight_gains(model, mapping).settings)
        say("loading the configuration")
        sitl.configure(configuration(mapping, settings), timeout=timeout)
        say("compiling the vehicle")
        aircraft = standing(vehicle)
        plant = Plant(aircraft, mapping, Surroundings(around), engine=link_engine(lambda text: say(text)))
        plant.prepare()
        pilot = pilot_for(model, plant.standing_depth)
        session = BetaflightSession(plant, mapping, Sensing(plant), Notices(lambda text: say(text)), sticks=pilot)
        session.pace, session.in_lockstep = asked.speedup if clock else min(asked.speedup, _PACE), clock is not None
        sweeps = tuple(StickSweep(axis, *band, seconds) for axis in axes)
        trial = BetaflightTrial(session, pilot, sitl, asked.height or 1.5, asked.hover or 5.0, sweeps)
        trial.lines.append(TrialLine("configuration", f"{len(settings)} settings", "loaded without an error", True))
        begun = time.monotonic()
        with sitl:
            say("starting the binary")
            sitl.wait_until_up(timeout)
            with Background(lambda go_on: serve(bound, session, go_on=go_on)) as physics:
                try:
                    trial.fly(say)
                except TrialEndedError as error:
                    trial.lines.append(TrialLine("flight", str(error), "to its end", False))
                if physics.failed:
                    trial.lines.append(TrialLine("physics", str(physics.failed[0]), "answers to the end", False))
        told = session.exchanged
        speed = plant.time / max(time.monotonic() - begun, 1e-9)
        what = f"exchanges, {'' if clock else 'no '}lockstep"
        words = f"{told.states} states, motors for {100.0 * told.answered:.1f} %, {1e3 * told.longest:.0f} ms at most"
        trial.lines.append(TrialLine(what, f"{words}, {1e3 * told.lost:.0f} ms lost"))
    say("reading the log")
    logs = sitl.logs()
    other = model if truth is None else linearize(airborne(truth), trim(airborne(truth), environment=around))
    comparison = _judged(logs, trial, other, mapping) if trial.excited else None
    called, log = name_of(asked.vehicle) or vehicle.card.called, logs[-1] if logs else None
    command = (str(sitl.binary),)
    return Acceptance(
        str(asked.binary), _version(sitl), called, command, tuple(trial.lines), comparison, log, folder, speed
    )


def _version(sitl: BetaflightBinary) -> str:
    logs = sitl.logs()
    if not logs:
        return "Betaflight's SITL"
    head = logs[-1].read_bytes()[:20_000].decode("latin-1")
    revisions = [line for line in head.splitlines() if line.startswith("H Firmware revision:")]
    return revisions[0].partition(":")[2].strip() if revisions else "Betaflight's SITL"


def _judged(
    logs: Sequence[Path], trial: BetaflightTrial, model: LinearModel, mapping: MotorMapping
) -> TruthBeside | None:
    """The responses of the newest log; lines are added for it and for each axis."""
    lines = trial.lines
    if not logs:
        lines.append(TrialLine("log", "none was written", "a Blackbox log", False))
        return None
    try:
        flight = read(logs[-1])
    except SwashError as error:
        lines.append(TrialLine("log", str(error), "read", False))
        return None
    damage = "; ".join(flight.provenance.damage)
    lines.append(TrialLine("log", damage or f"{flight.duration:.0f} s", "read, not damaged", not damage))
    comparison, longest = TruthBeside(), trial.session.exchanged.longest
    for axis, (sweep, began) in trial.excited.items():
        try:
            lines += _axis(flight, axis, sweep, began, trial, model, mapping, longest, comparison)
        except SwashError as error:
            lines.append(TrialLine(f"{axis}: response", str(error), "a response", False))
    return comparison


def _axis(
    flight: Flight,
    axis: str,
    sweep: StickSweep,
    began: float,
    trial: BetaflightTrial,
    model: LinearModel,
    mapping: MotorMapping,
    longest: float,
    comparison: TruthBeside,
) -> list[TrialLine]:
    """Truth beside the response from the mixer's command to the rate.

    The command is what the motors got of it: the mixer limits the sums that a log has. The log's clock is held against
    ours by the stick, and the truth is taken at our frequencies.

    In lockstep motors are held for a loop, so the truth is half of one late. Without, it is not: a step moves the time
    that has passed under the newest motors, which is early by what a state waits for its loop; then either side may be
    off by the longest step that there was, and so may the phase, besides its random error. In lockstep that is a loop:
    which one's motors a frame of the log has. Frames hold command and rate of one time, so records add nothing.
    """
    place, command, stick = AXES.index(axis), f"mixer_{axis}", f"stick_{axis}"
    rate = f"{RATES[place]}_imu" if f"{RATES[place]}_imu" in flight else RATES[place]
    pilot = np.array(trial.pilot.sent)
    about = float(flight.time(stick)[0]) + began - trial.armed
    clock = log_clock(
        flight.time(stick), flight.values(stick), lambda t: np.interp(began + t, pilot[:, 0], pilot[:, 1 + place]),
        sweep.seconds, about, channel=stick,
    )  # fmt: skip
    piece = flight.between(clock.start, clock.start + sweep.seconds / clock.ratio)
    names, logged = [f"motor_{channel}" for channel in mapping.channels], piece
    if all(name in piece for name in names):
        motors = np.array([piece.values(name) for name in names])
        piece = piece.with_channel(command, SIGNS[place] * mapping.commands(motors)[place], like=names[0])
    band = (1.25 * sweep.low, 0.75 * sweep.high)
    records = uniform_records([piece], (command, rate, stick), rate=_RATE)
    response = respond(records, inputs=[command], outputs=[rate], references=(stick,), band=band)
    h, coherence, error = response.pair(rate, command)
    good = np.isfinite(h) & (coherence >= _COHERENT)
    omega = response.omega * clock.ratio
    late = 0.5 * LOOP if trial.session.in_lockstep else 0.0
    true = axis_response(model, mapping, place, omega) * np.exp(-1j * omega * late)
    share = float(np.mean(good))
    comparison.curves[(rate, command)] = {
        "truth": (response.omega, true),
        "respond": (response.omega, np.where(good, h, np.nan)),
    }
    comparison.remarks += [f"{axis}: {text}" for text in (*response.warnings, *response.problems)]
    told = f"{100.0 * share:.0f} % of the band"
    enough = share >= _LEAST_SHARE
    slow = f"{100.0 * (clock.ratio - 1.0):.2f} % slower than the physics"
    lines = [
        TrialLine(f"{axis}: clock of the log", slow),
        TrialLine(f"{axis}: coherent", told, f"{100.0 * _LEAST_SHARE:.0f} % of the band", enough),
    ]
    if good.any():
        gain, phase = gain_and_phase_off(h[good], true[good])
        sigma = np.nan_to_num(error[good])
        limit = phase_limit(response.omega[good], longest)
        right = (gain <= np.maximum(GAIN, SIGMAS * 8.686 * sigma)) & (phase <= limit + SIGMAS * np.degrees(sigma))
        words = f"{gain.max():.2f} dB, {phase.max():.1f} deg"
        expected = f"within {GAIN:g} dB and {limit.min():.1f} to {limit.max():.1f} deg, and {SIGMAS:g} random errors"
        passed = bool(right.all()) if enough else None
        lines.append(TrialLine(f"{axis}: response beside truth", words, expected, passed))
    try:
        worth = flown_loop(logged, axis, band=band).summary()
    except SwashError as error:  # an older log's header has no gains
        worth = error.problem
    lines.append(TrialLine(f"{axis}: rate loop", worth))
    return lines


def phase_limit(omega: Array, longest: float) -> Array:
    """Degrees that a response may be off besides its random error, at frequencies [rad/s], by what is not known of when
    motors acted [s]; as many as `PHASE`."""
    return np.minimum(PHASE, np.degrees(omega * longest))
