"""`sp.accept_autopilot` and `swash link accept` against a stand-in that is started as a binary: it passes from a cold
start, another truth or another frame does not, and whatever goes wrong is named and leaves no process behind."""

from __future__ import annotations

import json
import math
import os
import socket
import stat
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pymavlink")

import swashplate as sp
from swashplate.api.acceptance import Acceptance
from swashplate.api.truth_beside import Truth, TruthBeside, beside_truth
from swashplate.control.laws.ardupilot.outputs import HELD, LOGGED, density_gain, output_delays
from swashplate.flights.maneuvers.ardupilot_chirp import Chirp
from swashplate.flights.maneuvers.sweeps import sweeps
from swashplate.links import sitl_binary
from swashplate.links.ardupilot import trial
from swashplate.links.ardupilot.gains import ardupilot_law
from swashplate.links.ardupilot.mixer_responses import MIXER_AXES, mixed, mixer_response
from swashplate.links.ardupilot.trial_sweeps import RESOLVED_AT_TRIM, gentle_sweep, largest_pulse
from swashplate.links.servos import servo_mapping
from swashplate.models.vehicle import Vehicle
from swashplate.simulation.standing import airborne

BINARY = Path(__file__).parents[2] / "sitl_standin.py"
RAPTOR = sp.vehicle("raptor50")
GAINS = {
    **{f"ATC_ANG_{axis}_P": 4.5 for axis in ("RLL", "PIT", "YAW")},
    "ATC_RAT_RLL_FF": 0.16,
    "ATC_RAT_RLL_P": 0.045,
    "ATC_RAT_RLL_I": 0.09,
    "ATC_RAT_RLL_ILMI": 0.19,
    "ATC_RAT_PIT_FF": 0.20,
    "ATC_RAT_PIT_P": 0.057,
    "ATC_RAT_PIT_I": 0.11,
    "ATC_RAT_PIT_ILMI": 0.1,
    "ATC_RAT_YAW_FF": 0.0,
    "ATC_RAT_YAW_P": 0.27,
    "ATC_RAT_YAW_I": 0.32,
}
"""Of the Raptor 50, given as a user's file: to search them takes longer than the flights here."""
COAX = sp.vehicle("coax")
COAX_GAINS = {
    **{f"ATC_ANG_{axis}_P": value for axis, value in (("RLL", 6.0), ("PIT", 6.0), ("YAW", 4.5))},
    **{f"ATC_RAT_{axis}_{name}": value for axis in ("RLL", "PIT") for name, value in (("P", 0.075), ("I", 0.112))},
    "ATC_RAT_RLL_D": 0.015,
    "ATC_RAT_PIT_D": 0.015,
    "ATC_RAT_YAW_P": 0.03,
    "ATC_RAT_YAW_I": 0.045,
    "PSC_POSXY_P": 0.058,
    "PSC_VELXY_P": 0.39,
}
"""What `autopilot_gains` finds for it."""
QUICK: dict[str, Any] = {"seconds": 12.0, "hover": 1.5, "height": 2.0, "timeout": 30.0, "speedup": 100.0}


@pytest.fixture(autouse=True)
def found_by_the_binary(monkeypatch: pytest.MonkeyPatch) -> None:
    """The stand-in is a program of its own and has to find what this one has."""
    import sys

    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    monkeypatch.setenv("PATH", os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))


def instance() -> int:
    """One whose ports are free, by the worker: tests run side by side."""
    return 20 + 5 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))


def accept(out: Path, *, faults: str = "", axes: tuple[str, ...] = ("yaw",), **more: Any) -> Acceptance:
    os.environ["SWASH_STANDIN"] = faults
    try:
        gains = out.parent / "gains.parm"
        gains.write_text("".join(f"{name},{value}\n" for name, value in GAINS.items()))
        given = {**QUICK, "axes": axes, "instance": instance(), "defaults": [gains], **more}
        return sp.accept_autopilot("raptor50", BINARY, folder=out, **given)
    finally:
        del os.environ["SWASH_STANDIN"]


def is_gone(out: Path, folder: str = "sitl") -> bool:
    """Whether the stand-in's process, which wrote down its number, has ended."""
    try:
        os.kill(int((out / folder / "pid").read_text()), 0)
    except ProcessLookupError:
        return True
    return False


@pytest.fixture(scope="module")
def accepted(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Acceptance, Path]]:
    """From a cold start: 40 s until the EKF is ready, three hovers, a sweep of yaw, landing."""
    with pytest.MonkeyPatch.context() as patch:
        import sys

        patch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
        out = tmp_path_factory.mktemp("accepted") / "trial"
        yield accept(out), out


def test_it_passes_from_a_cold_start(accepted: tuple[Acceptance, Path]) -> None:
    found, out = accepted
    assert found.problems == ()
    assert found.passed
    lines = {line.what: line for line in found.lines}
    waited = float(lines["ready to be armed"].found.split()[1])
    assert waited >= 40.0, "the stand-in's EKF takes that long"
    hovers = {f"hover in {mode}" for mode in ("STABILIZE", "ALT_HOLD", "LOITER")}
    judged = {"armed", "lift-off", *hovers, "sweep of yaw", "landing", "log", "yaw: respond beside truth"}
    judged |= {"yaw: fit-tf beside truth", "yaw: fit-ss beside truth", "parameters read back"}
    assert {line.what for line in found.lines if line.passed} >= judged
    assert found.log is not None
    assert found.log.parent == out / "sitl" / "logs"
    assert is_gone(out)
    assert float(lines["rotor speed in the log, largest"].found.split()[0]) == pytest.approx(
        float(lines["rotor speed in the log, largest"].expected.split()[0]), rel=0.02
    )


def test_the_command_line_is_sitl_s(accepted: tuple[Acceptance, Path]) -> None:
    found, out = accepted
    assert found.command[1:7] == (
        "--model",
        "JSON:127.0.0.1",
        "--defaults",
        "trial.parm,vehicle.parm,yours-1.parm",
        "-I",
        str(instance()),
    )
    files = [(out / "sitl" / name).read_text() for name in ("trial.parm", "vehicle.parm")]
    assert "FRAME_CLASS,6\n" in files[1]
    assert "SID_AXIS,12\n" in files[0]


def test_what_it_found_is_shown_and_saved(accepted: tuple[Acceptance, Path]) -> None:
    found, out = accepted
    found.save(out)
    assert "Truth beside estimate" in (out / "report.html").read_text(encoding="utf-8")
    document = json.loads((out / "acceptance.json").read_text(encoding="utf-8"))
    assert document["passed"] is True
    assert len(document["truth_beside_estimate"]["r/mixer_yaw"]) == 3
    assert "pass" in repr(found)
    assert "r / mixer_yaw" in repr(found)


def truth_of(vehicle: Vehicle, *, name: str, rate: float = 200.0) -> Truth:
    """What a vehicle answers to the mixer's commands, with a stand-in's loop rate."""
    flying = airborne(vehicle)
    hover = sp.trim(flying)
    model = sp.linearize(flying, hover)
    law = ardupilot_law(servo_mapping(name, flying), flying, hover, given={})
    gain = density_gain(law.frame, hover.environment.air_density)
    moves = {k: gain * v for k, v in mixed(law.mixer, hover, law.parameters, inputs=flying.input_names).items()}

    def truth(axis: str, output: str, omega: np.ndarray) -> np.ndarray:
        late = (HELD + LOGGED) / rate + output_delays("ardupilot", law.frame, len(flying.input_names), rate)
        return mixer_response(model, moves[axis], output, omega, delay=late, gravity=9.80665)

    return truth


def judged_against(
    vehicle: Vehicle, log: Path, *, own: Vehicle = RAPTOR, name: str = "raptor50", **swept: float
) -> TruthBeside:
    """By axis so many seconds of sweep, over the band that the log tells."""
    flight = sp.read(log)
    bands = {sweep.axis: (sweep.low, sweep.high) for sweep in sweeps(flight) if sweep.source == "log"}
    chirps = {}
    for axis, seconds in (swept or {"yaw": QUICK["seconds"]}).items():
        named = Chirp.planned(MIXER_AXES[axis].number, 0.1, (0.4, 8.0), record=seconds, fade=1.0)
        chirps[axis] = replace(named, start_hz=bands[named.axis_name][0], stop_hz=bands[named.axis_name][1])
    return beside_truth(flight, chirps, truth_of(vehicle, name=name), truth_of(own, name=name), rate=100.0, loop=200.0)


@pytest.mark.parametrize("share", [0.75, *(pytest.param(share, marks=pytest.mark.proof) for share in (1.0, 1.3))])
def test_another_truth_fails(accepted: tuple[Acceptance, Path], share: float) -> None:
    """The same log beside a vehicle whose yaw inertia is another: only the one that flew passes."""
    found, _ = accepted
    assert found.log is not None
    inertia = RAPTOR.card.values()["inertia_zz"]
    beside = judged_against(RAPTOR.with_values({"inertia_zz": share * inertia}), found.log)
    verdicts = {line.what: line.passed for line in beside.lines if "beside truth" in line.what}
    assert len(verdicts) == 3
    assert set(verdicts.values()) == {share == 1.0}


def test_a_wrong_frame_fails_before_it_flies(tmp_path: Path) -> None:
    found = accept(tmp_path / "t", faults="frame")
    assert found.problems == (
        "parameters read back: FRAME_CLASS is 8, expected 6. (expected as the vehicle needs them).",
    )
    assert is_gone(tmp_path / "t")


@pytest.mark.parametrize(
    ("faults", "ekf", "words"),
    [
        ("never-ekf", 4.0, "not within 4 s: PreArm: Need Position Estimate"),
        pytest.param("warm,nowhere", 20.0, "not within 20 s: its EKF has no place", marks=pytest.mark.proof),
    ],
)
def test_an_ekf_that_is_never_ready(faults: str, ekf: float, words: str, tmp_path: Path) -> None:
    """The second could be armed in STABILIZE, and would be refused LOITER in the air."""
    found = accept(tmp_path / "t", faults=faults, ekf=ekf)
    assert words in found.problems[0]
    assert is_gone(tmp_path / "t")


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        pytest.param("warm,crash", "the binary ended by SIGFPE; its last words: ", marks=pytest.mark.proof),
        pytest.param("warm,frozen", "sent no servo packet for 2 s", marks=pytest.mark.proof),
        pytest.param("warm,reboot", "the autopilot restarted by itself", marks=pytest.mark.proof),
        pytest.param("warm,sweepless", "mode SYSTEMID: refused: ", marks=pytest.mark.proof),
    ],
)
def test_what_happens_in_the_air_is_a_line(
    faults: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "frozen" in faults:  # the others may be slow on a busy machine
        monkeypatch.setattr(trial, "_STALLED", 2.0)
    found = accept(tmp_path / "t", faults=faults)
    assert not found.passed
    assert any(words in text for text in found.problems), found.problems
    assert is_gone(tmp_path / "t")


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        ("mute", "no autopilot was heard within 6 s"),
        pytest.param("plane", "MAVLink's type 1 answers", marks=pytest.mark.proof),
        ("copter", "this is the build for multicopters and coaxials with two motors"),
        pytest.param("old,stubborn", "is version 4.1.7, expected 4.5 or later", marks=pytest.mark.proof),
    ],
)
def test_who_is_not_arducopter(faults: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sitl_binary, "PATIENCE", 0.3)
    with pytest.raises(sp.SwashError, match=words):
        accept(tmp_path / "t", faults=faults, timeout=6.0 if faults == "mute" else 30.0)
    assert is_gone(tmp_path / "t", "first-start")
    assert not (tmp_path / "t" / "sitl").exists()


def program(path: Path, text: str, *, executable: bool = True) -> Path:
    path.write_text(text)
    if executable:
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_binaries_that_are_none(tmp_path: Path) -> None:
    silent = program(tmp_path / "silent", "#!/bin/sh\nsleep 60\n")
    cases = {
        tmp_path / "missing": "there is no such file",
        tmp_path: "is no file",
        program(tmp_path / "plain", "#!/bin/sh\n", executable=False): "is not executable",
        program(tmp_path / "arm", "\x7fELF for another machine"): "cannot be run: Exec format error",
        program(tmp_path / "tool", "#!/bin/sh\necho unrecognized option; exit 3\n"): (
            "ended with exit code 3; its last words: unrecognized option"
        ),
        silent: "opened no MAVLink port",
    }
    for k, (binary, words) in enumerate(cases.items()):
        with pytest.raises(sp.SwashError, match=words):
            sp.accept_autopilot("raptor50", binary, folder=tmp_path / f"out-{k}", instance=instance(), timeout=1.0)


def test_ports_and_folders_that_are_taken(tmp_path: Path) -> None:
    number = instance() + 1
    for kind, port in ((socket.SOCK_STREAM, 5762), (socket.SOCK_DGRAM, 5501), (socket.SOCK_DGRAM, 9002)):
        with socket.socket(socket.AF_INET, kind) as taken:
            taken.bind(("127.0.0.1", port + 10 * number))
            if kind is socket.SOCK_STREAM:
                taken.listen(1)
            with pytest.raises(sp.SwashError, match=f"port {port + 10 * number} .*in use"):
                accept(tmp_path / f"t{port}", instance=number)
    (tmp_path / "there" / "sitl").mkdir(parents=True)
    with pytest.raises(sp.SwashError, match="is there already"):
        accept(tmp_path / "there")
    with pytest.raises(sp.SwashError, match="'rol' is none of roll"):
        accept(tmp_path / "axis", axes=("rol",))


def test_the_truth_of_an_axis_has_its_sign_and_size() -> None:
    """A mixer's roll right makes p grow at once by Lb's share: the linear model's own B, through the mapping."""
    flying = airborne(RAPTOR)
    model = sp.linearize(flying, sp.trim(flying))
    mapping = servo_mapping("raptor50", flying)
    law = ardupilot_law(mapping, flying, model.trim, given={})
    moves = mixed(law.mixer, model.trim, law.parameters, inputs=flying.input_names)
    mapping.restart()

    def inputs(roll: float, pitch: float, yaw: float, throttle: float) -> np.ndarray:
        share = 0.46 + 0.28 * throttle
        swash = [
            share + 0.45 * (math.cos(math.radians(at + 90.0)) * roll + math.cos(math.radians(at)) * pitch)
            for at in (-60.0, 60.0, 180.0)
        ]
        pulses = [1000.0 + 1000.0 * s for s in swash]
        return np.array(mapping.inputs([*pulses, 1500.0 + 500.0 * yaw, 0, 0, 0, 1000.0], 0.01))

    for k, axis in enumerate(("roll", "pitch", "yaw", "heave")):
        step = np.eye(4)[k] * 1e-3
        moved = (inputs(*step) - inputs(*-step)) / 2e-3
        np.testing.assert_allclose(moves[axis], moved, atol=1e-9)
        a = MIXER_AXES[axis]
        low = mixer_response(model, moves[axis], a.output, np.array([200.0]), delay=0.0, gravity=9.81)
        assert abs(low[0]) > 0.0


@pytest.mark.proof
def test_all_axes_and_a_changed_vehicle(tmp_path: Path) -> None:
    """The whole trial; and beside a vehicle with another hub the same flight is refused for roll and pitch."""
    changed = RAPTOR.with_values({"hub_stiffness": 2.0 * RAPTOR.card.values()["hub_stiffness"]})
    found = accept(tmp_path / "a", axes=tuple(MIXER_AXES), seconds=40.0, hover=5.0)
    assert found.problems == ()
    assert sum("beside truth" in line.what for line in found.lines) == 12
    other = accept(tmp_path / "b", axes=("roll", "pitch"), seconds=20.0, against=changed)
    failed = [line.what for line in other.lines if line.passed is False]
    assert "roll: respond beside truth" in failed
    assert "pitch: respond beside truth" in failed


def test_a_coaxial_s_mixer_moves_motors_by_its_thrust_curve_and_flaps_over_its_thrust() -> None:
    """The Jacobian, against the stand-in's own mixing from ArduPilot's documents and the mapping behind it."""
    flying = airborne(COAX)
    hover = sp.trim(flying)
    mapping = servo_mapping("coax", flying)
    law = ardupilot_law(mapping, flying, hover, given={})
    moves = mixed(law.mixer, hover, law.parameters, inputs=flying.input_names)
    at = law.mixer.unmixed(hover.inputs, law.parameters)

    def motor(thrust: float) -> float:
        return 0.15 + 0.8 * (-0.35 + math.sqrt(0.35**2 + 2.6 * thrust)) / 1.3

    def inputs(roll: float, pitch: float, yaw: float, throttle: float) -> np.ndarray:
        over = min(1.0, max(0.5, throttle))
        motors = [1000.0 + 1000.0 * motor(throttle + half * yaw) for half in (0.5, -0.5)]
        flaps = [1500.0 + 500.0 * roll / over, 1500.0 + 500.0 * pitch / over]
        return np.array(mapping.inputs([*flaps, 1500.0, 1500.0, *motors, 0, 0], 0.01))

    for k, axis in enumerate(("roll", "pitch", "yaw", "heave")):
        step = np.eye(4)[k] * 1e-4
        moved = (inputs(*(at + step)) - inputs(*(at - step))) / 2e-4
        np.testing.assert_allclose(moves[axis], moved, atol=1e-5)


@pytest.mark.proof
def test_a_coaxial_with_another_frame_is_not_flown(tmp_path: Path) -> None:
    out = tmp_path / "t"
    found = coaxial(out, axes=("yaw",), faults="frame")
    assert found.problems == (
        "parameters read back: FRAME_CLASS is 8, expected 9. (expected as the vehicle needs them).",
    )
    assert is_gone(out)


@pytest.mark.proof
def test_a_coaxial_is_accepted_and_no_other_one(tmp_path: Path) -> None:
    """The whole trial; and the same log beside a coaxial of other inertia or mass, or one that turns the other way."""
    found = coaxial(tmp_path / "a", axes=tuple(MIXER_AXES))
    assert found.problems == ()
    judged = {line.what for line in found.lines if line.passed and "beside truth" in line.what}
    assert judged >= {f"{axis}: respond beside truth" for axis in MIXER_AXES}
    assert {"yaw: fit-tf beside truth", "heave: fit-tf beside truth"} <= judged
    assert found.log is not None
    values, changes = COAX.card.values(), {"yaw": "inertia_zz", "roll": "inertia_xx", "heave": "mass"}
    changed = [(axis, COAX.with_values({key: k * values[key]})) for axis, key in changes.items() for k in (0.75, 1.3)]
    for axis, other in [("yaw", COAX), *changed]:
        beside = judged_against(other, found.log, own=COAX, name="coax", **{axis: 40.0})
        verdicts = {line.passed for line in beside.lines if "beside truth" in line.what and line.passed is not None}
        assert verdicts == {other is COAX}, (axis, beside.lines)


@pytest.mark.proof
def test_a_coaxial_that_yaws_backwards_fails(tmp_path: Path) -> None:
    found = coaxial(tmp_path / "t", axes=("yaw",), faults="backwards")
    assert not found.passed
    assert is_gone(tmp_path / "t")


def test_a_sweep_begins_where_its_outputs_are_resolved() -> None:
    """A coaxial's loops leave a slow sweep of yaw one microsecond, which rounding turns by 6 degrees at 0.5 Hz."""
    flying = airborne(COAX)
    hover = sp.trim(flying)
    mapping, model = servo_mapping("coax", flying), sp.linearize(flying, hover)
    law = ardupilot_law(mapping, flying, hover, given={})
    moved = mixed(law.mixer, hover, law.parameters, inputs=flying.input_names)["yaw"]
    assert largest_pulse(mapping, moved) == pytest.approx(403.0, rel=0.02), "500 us through the thrust curve"
    planned = partial(gentle_sweep, model, moved, "yaw", seconds=40.0, gravity=9.81, mapping=mapping)
    held = {**law.parameters, **COAX_GAINS}
    sweep = planned(held, band=(0.4, 8.0))
    assert 0.4 < sweep.start_hz < 1.5
    assert planned(held, band=(3.0, 8.0)).start_hz == 3.0
    rolls = mixed(law.mixer, hover, law.parameters, inputs=flying.input_names)["roll"]
    damped = gentle_sweep(
        model,
        rolls,
        "roll",
        held,
        band=(0.4, 8.0),
        seconds=40.0,
        gravity=9.81,
        mapping=mapping,
        least=RESOLVED_AT_TRIM,
    )
    assert damped.magnitude > 0.05, "the derivative damps the bar's resonance; 0.01 were planned without it"
    with pytest.raises(sp.SwashError, match="no gentle sweep of yaw moves an output by 4 us"):
        planned({**held, "ATC_RAT_YAW_P": 3.0}, band=(0.4, 2.0))


def coaxial(out: Path, *, axes: tuple[str, ...], seconds: float = 40.0, faults: str = "") -> Acceptance:
    gains = out.parent / "coax-gains.parm"
    gains.write_text("".join(f"{name},{value}\n" for name, value in COAX_GAINS.items()))
    os.environ["SWASH_STANDIN"] = f"copter,{faults}"
    try:
        return sp.accept_autopilot(
            "coax", BINARY, folder=out, axes=axes, instance=instance(), defaults=[gains],
            seconds=seconds, hover=3.0, height=3.0, timeout=60.0, speedup=100.0,
        )  # fmt: skip
    finally:
        del os.environ["SWASH_STANDIN"]
