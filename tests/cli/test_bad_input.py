"""Everything that a user can get wrong: exit code 2, one message with file, channel and remedy, and nothing written."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import one_message, swash, swash_process
from scipy.io import savemat

from made_logs import coax_record, dimensions, write_coax
from simulated_flights import FREE, TIE
from swashplate.compiler import compiler
from swashplate.flights.flight import Flight
from swashplate.models.card import packaged_cards

LONG = 600  # samples: 4 s, long enough for what is not about length
SERVOS = ("servo_roll", "servo_pitch")
TOLD_BY_NOTHING = ("--free", ",".join(FREE), "--settings", f"tie={TIE}", "--method", "output-error")
"""The same free parameters as in the end-to-end test: nothing compiles anew."""


def _gigantic(path: Path) -> Path:
    """A MATLAB header that claims 80 GB."""
    flags = struct.pack("<IIII", 6, 8, 6, 0)
    name = struct.pack("<HH4s", 1, 4, b"Data")
    data = struct.pack("<II", 9, 0)
    body = flags + dimensions(100_000, 100_000) + name + data
    path.write_bytes(
        b"MATLAB 5.0 MAT-file".ljust(124)
        + struct.pack("<H2s", 0x0100, b"IM")
        + struct.pack("<II", 14, len(body))
        + body
    )
    return path


def _text(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


def _mat(path: Path, **fields: Any) -> Path:
    savemat(path, fields)
    return path


def _with(name: str, change: Callable[[np.ndarray[Any, Any]], Any]) -> Callable[[Path], Path]:
    def write(path: Path) -> Path:
        record = coax_record(LONG)
        array = record[name].astype(float)
        changed = change(array)
        savemat(path, {"Data": {**record, name: array if changed is None else changed}})
        return path

    return write


def _one_nan(position: np.ndarray[Any, Any]) -> None:
    position[1, 100] = np.nan


def _back(time: np.ndarray[Any, Any]) -> None:
    time[300] = time[100]


def _twice(time: np.ndarray[Any, Any]) -> None:
    time[300] = time[299]


BAD: dict[str, tuple[Callable[[Path], Path], str, tuple[str, ...]]] = {
    "missing file": (lambda p: p, "a.mat", ("no such file",)),
    "a folder": (lambda p: (p.mkdir(), p)[1], "a.mat", ("is a folder",)),
    "empty file": (lambda p: _text(p, ""), "a.mat", ("empty",)),
    "not a .mat": (lambda p: _text(p, "hello"), "a.mat", ("is not a MATLAB .mat file",)),
    "wrong struct": (lambda p: _mat(p, Bench=np.ones(3)), "a.mat", ("found Bench", "mapping file")),
    "no struct": (lambda p: _mat(p, Data=np.arange(3.0)), "a.mat", ("found Data", "mapping file")),
    "missing channel": (lambda p: write_coax(p, orientation=None), "a.mat", ("orientation",)),
    "one NaN": (_with("position", _one_nan), "a.mat", ("position", "1 of 600 samples", "sample 100")),
    "wrong units": (_with("position", lambda x: 1000.0 * x + 1e6), "a.mat", ("position", "--unit position=mm")),
    "milliseconds": (_with("time", lambda t: 1000.0 * t), "a.mat", ("time", "6.6", "--unit time=ms")),
    "NaN only": (_with("inputs", lambda x: np.full_like(x, np.nan)), "a.mat", ("inputs", "600 of 600 samples")),
    "time backwards": (_with("time", _back), "a.mat", ("time",)),
    "time doubled": (_with("time", _twice), "a.mat", ("time",)),
    "one sample": (
        lambda p: _mat(p, Data={k: np.atleast_2d(v)[:, :1] for k, v in coax_record().items()}),
        "a.mat",
        ("time", "one sample"),
    ),
    "too short": (lambda p: write_coax(p), "a.mat", ("0.073 s", "1.000 s")),
    "gigantic header": (_gigantic, "a.mat", ("claims 10,000,000,000",)),
    "csv without units": (lambda p: _text(p, "time,x\n0,1\n1,2\n"), "a.csv", ("time", "no unit")),
    "csv wrong unit": (lambda p: _text(p, "time [s],x [kg]\n0,1\n1,2\n"), "a.csv", ("x", "kg")),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_flight_is_refused_and_nothing_is_written(case: str, tmp_path: Path) -> None:
    make, name, expected = BAD[case]
    logs = tmp_path / "logs"
    logs.mkdir()
    path = make(logs / name)
    outcome = swash("identify", "--vehicle", "coax", "--flight", path, "--out", tmp_path / "fit")
    message = one_message(outcome)
    for part in (name, *expected):
        assert part in message, message
    assert [entry.name for entry in tmp_path.iterdir()] == ["logs"]


def test_a_constant_input_is_seen_by_inspect(tmp_path: Path) -> None:
    def hold(inputs: np.ndarray[Any, Any]) -> None:
        inputs[2] = 0.25

    outcome = swash("inspect", _with("inputs", hold)(tmp_path / "a.mat"))
    assert outcome.code == 0
    assert re.search(r"servo_roll\b[^\n]*: never move", outcome.out)


def _standing(path: Path) -> Path:
    """A log long enough to work on in which no command ever moves."""
    record = coax_record(LONG)
    return _mat(path, Data={**record, "inputs": np.tile([[0.55], [0.55], [0.0], [0.1]], (1, LONG))})


def test_a_flight_whose_inputs_are_all_constant_is_refused(simulated: Path, tmp_path: Path) -> None:
    """By every verb that learns or judges; the simulated flight stands beside it and does not help."""
    logs = tmp_path / "logs"
    logs.mkdir()
    path = _standing(logs / "a.mat")
    for arguments in (
        ("identify", "--vehicle", "coax", "--flight", path, "--out", tmp_path / "fit"),
        ("validate", "--vehicle", "coax", "--flight", path, "--out", tmp_path / "fit"),
    ):
        message = one_message(swash(*arguments))
        for part in ("a.mat", "servo_roll", "no input ever moves", "fly a sweep"):
            assert part in message, message
    assert [entry.name for entry in tmp_path.iterdir()] == ["logs"]


def test_a_constant_input_is_named_in_words_and_refuses_what_only_it_could_tell(
    simulated: Path, tmp_path: Path
) -> None:
    """Both servos stand still at zero, so their linkage leaves no trace; the motors move on."""
    flight = Flight.load(simulated)
    streams = dict(flight.streams)
    streams["inputs"] = streams["inputs"].assign({name: 0.0 * streams["inputs"][name] for name in SERVOS})
    path = flight.with_streams(streams).save(tmp_path / "still.nc")
    out = tmp_path / "fit"
    message = one_message(swash("identify", "--vehicle", "coax", "--flight", path, *TOLD_BY_NOTHING, "--out", out))
    for part in ("still.nc", "linkage_lower", "no information", "fly what moves it"):
        assert part in message, message
    assert [entry.name for entry in tmp_path.iterdir()] == ["still.nc"]


def test_a_parameter_that_the_flight_cannot_tell_is_refused(simulated: Path, tmp_path: Path) -> None:
    """Without a linkage from the bar to the blades its time constant leaves no trace."""
    refused = swash(
        *("identify", "--vehicle", "coax", "--flight", simulated, *TOLD_BY_NOTHING),
        *("--fix", "linkage_upper=0", "--out", tmp_path / "fit"),
    )
    message = one_message(refused)
    for part in ("simulated", "tau_f_upper", "no information", "prior"):
        assert part in message, message
    assert list(tmp_path.iterdir()) == []


def test_a_flight_without_an_input_is_refused(simulated: Path, tmp_path: Path) -> None:
    flight = Flight.load(simulated)
    streams = dict(flight.streams)
    streams["inputs"] = streams["inputs"].drop_vars("motor_upper")
    path = flight.with_streams(streams).save(tmp_path / "less.nc")
    message = one_message(swash("identify", "--vehicle", "coax", "--flight", path, "--out", tmp_path / "fit"))
    assert "motor_upper" in message
    assert not (tmp_path / "fit").exists()


def _card(change: Callable[[str], str], path: Path) -> Path:
    text = packaged_cards()["coax"].to_toml()
    changed = change(text)
    assert changed != text
    return _text(path, changed)


CARDS: dict[str, tuple[Callable[[str], str], tuple[str, ...]]] = {
    "missing": (lambda t: t.replace("[parameters.mass]", "[parameters.mass_2]", 1), ("mass", "missing")),
    "misspelt": (
        lambda t: t + '\n[parameters.masss]\nvalue = 1.0\nunit = "kg"\nsource = "?"\nstatus = "assumed"\n',
        ("masss", "not a parameter"),
    ),
    "wrong unit": (lambda t: t.replace('unit = "kg"\n', 'unit = "g"\n', 1), ("mass", "'g'", "'kg'")),
    "no unit": (lambda t: t.replace('unit = "kg"\n', "", 1), ("mass", "lacks unit")),
    "negative sigma": (
        lambda t: t.replace("value = 0.302\n", "value = 0.302\nsigma = -0.1\n", 1),
        ("mass", "sigma is -0.1"),
    ),
    "beyond its bounds": (lambda t: t.replace("value = 0.302", "value = -0.3", 1), ("mass", "-0.3 kg", "0.05 to 2 kg")),
    "misspelt table": (lambda t: t.replace("[options]", "[optoins]", 1), ("optoins", "no part of a card")),
    "strange schema": (lambda t: t.replace("schema = 1", 'schema = "x"', 1), ("schema", "'x'")),
    "not a number": (lambda t: t.replace("value = 0.302", 'value = "0.302"', 1), ("mass", "number")),
    "not TOML": (lambda t: t.replace("[parameters.mass]", "[parameters.mass", 1), ("TOML",)),
    "another kind": (lambda t: t.replace('kind = "vehicle"', 'kind = "toaster"', 1), ("toaster",)),
    "other equations": (lambda t: t.replace('vehicle = "coax"', 'vehicle = "kite"', 1), ("kite", "coax")),
}


@pytest.mark.parametrize("case", CARDS)
def test_a_bad_card_is_refused(case: str, simulated: Path, tmp_path: Path) -> None:
    change, expected = CARDS[case]
    card = _card(change, tmp_path / "card.toml")
    for arguments in (
        ("vehicle", "show", card),
        ("identify", "--vehicle", card, "--flight", simulated, "--out", tmp_path / "fit"),
        ("validate", "--vehicle", card, "--flight", simulated, "--out", tmp_path / "fit"),
        ("simulate", "--vehicle", card, "--maneuver", "step:roll,1s", "--out", tmp_path / "flight.nc"),
    ):
        message = one_message(swash(*arguments))
        for part in ("card.toml", *expected):
            assert part in message, message
    assert [entry.name for entry in tmp_path.iterdir()] == ["card.toml"]


@pytest.mark.parametrize(
    ("extra", "expected"),
    [
        (("--fix", "mas=0.3"), ("mas", "no such parameter")),
        (("--fix", "mass"), ("--fix", "NAME=VALUE")),
        (("--fix", "mass=heavy"), ("--fix", "heavy")),
        (("--fix", "mass=-0.3"), ("mass", "-0.3 kg", "physics allows")),
        (("--fix", "mass=nan"), ("--fix", "nan")),
        (("--fix", "mass=0.3", "--fix", "mass=0.4"), ("mass", "twice")),
        (("--prior", "mass=0.3"), ("--prior", "2 numbers")),
        (("--prior", "tau_f_upper=1,-1"), ("tau_f_upper", "positive")),
        (("--settings", "tie=a_beta_u = __import__('os')"), ("__import__",)),
        (("--settings", "tie=nonsense = mass"), ("nonsense",)),
        (("--settings", "tie=drag_x = drag_y", "--settings", "tie=drag_y = drag_x"), ("circle", "drag_x")),
        (("--prior", "mass=0.3,0.1"), ("mass", "not free")),
        (("--free", "tau_f_uper"), ("tau_f_uper",)),
        (("--free", "mass,mass"), ("twice",)),
        (("--unit", "x"), ("--unit", "NAME=VALUE")),
        (
            ("--wind", "--method", "output-error"),
            ("wind", "'output-error' does not know it", "filter-error"),
        ),
        (("--settings", "cutoff=80"), ("80",)),
        (("--settings", "cutoff=0.05"), ("simulated.nc", "10.000 s", "0.05 Hz", "20.000 s")),
    ],
)
def test_a_wrong_option_is_refused(
    extra: tuple[str, ...], expected: tuple[str, ...], simulated: Path, tmp_path: Path
) -> None:
    message = one_message(
        swash("identify", "--vehicle", "coax", "--flight", simulated, "--out", tmp_path / "fit", *extra)
    )
    for part in expected:
        assert part in message, message
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_vehicle_is_refused(simulated: Path) -> None:
    message = one_message(swash("identify", "--vehicle", "coaks", "--flight", simulated))
    assert "coaks" in message
    assert "coax" in message.replace("coaks", "")


def test_unknown_data_sets_and_files_are_refused() -> None:
    assert "coax57" in one_message(swash("data", "fetch", "coax57"))
    message = one_message(swash("inspect", "coax56/flight_of_fancy"))
    assert "flight_of_fancy" in message
    assert "flight_2011-08-01_vertical.mat" in message


@pytest.mark.parametrize(
    ("maneuver", "expected"),
    [("swep:pitch,1-8Hz,60s", "swep"), ("sweep:pitch,0.1-8Hz,6s", "periods"), ("step:tail_rotor,1s", "tail_rotor")],
)
def test_a_wrong_maneuver_is_refused(maneuver: str, expected: str, tmp_path: Path) -> None:
    outcome = swash("simulate", "--vehicle", "coax", "--maneuver", maneuver, "--out", tmp_path / "a.nc")
    assert expected in one_message(outcome)
    assert list(tmp_path.iterdir()) == []


def test_what_a_simulation_cannot_fly_is_said_first(tmp_path: Path) -> None:
    command = ("simulate", "--vehicle", "coax", "--maneuver", "step:roll,1s", "--out", tmp_path / "a.nc")
    for extra, expected in (
        (("--sag", "5"), ("voltage", "falls to", "smaller sag")),
        (("--rate", "60"), ("60 Hz", "multiple of the controller's 50 Hz", "Give 50 Hz")),
        (("--set", "bar"), ("--set", "NAME=VALUE")),
    ):
        message = one_message(swash(*command, *extra))
        for part in expected:
            assert part in message, message
    message = one_message(swash("vehicle", "trim", "raptor50", "--speed", "0-4/2", "--out", tmp_path / "a.pdf"))
    assert "expected .html" in message
    assert list(tmp_path.iterdir()) == []


def test_an_input_that_stands_at_its_limit_is_said(tmp_path: Path) -> None:
    flown = swash("simulate", "--vehicle", "coax", "--maneuver", "doublet:roll,1s,5", "--out", tmp_path / "a.nc", "-q")
    assert flown.code == 0
    assert "Careful: servo_roll stands at its limit for" in flown.err


@pytest.mark.parametrize("out", ["a.xlsx", "nowhere/a.nc"])
def test_a_simulation_that_cannot_be_saved_is_refused(out: str, tmp_path: Path) -> None:
    outcome = swash("simulate", "--vehicle", "coax", "--maneuver", "step:roll,1s", "--out", tmp_path / out)
    assert out.split("/")[0] in one_message(outcome)


def test_a_hold_out_that_the_fit_has_seen_is_refused(simulated: Path, tmp_path: Path) -> None:
    alias = tmp_path / "alias.nc"
    alias.symlink_to(simulated)
    for flight, held in ((simulated, simulated), (simulated, alias), (f"{simulated}@0-6", f"{simulated}@4-9")):
        message = one_message(swash("identify", "--vehicle", "coax", "--flight", flight, "--hold-out", held))
        assert "same stretch" in message


def test_a_window_outside_the_flight_is_refused(simulated: Path) -> None:
    assert "window 50-60 s" in one_message(swash("inspect", f"{simulated}@50-60"))


def test_a_place_that_cannot_be_written_to_is_named_as_given(simulated: Path, tmp_path: Path) -> None:
    """Not by the temporary file that was to be renamed."""
    assert "nowhere/n.toml: " in one_message(
        swash("vehicle", "new", tmp_path / "nowhere" / "n.toml", "--mass", "4", "--radius", "0.6")
    )
    inside = _text(tmp_path / "fit", "mine") / "deeper"
    message = one_message(swash("identify", "--vehicle", "coax", "--flight", simulated, "--out", inside))
    assert message.startswith(f"Error: {inside}: ")


def test_an_output_folder_that_is_a_file_is_refused(simulated: Path, tmp_path: Path) -> None:
    out = _text(tmp_path / "fit", "mine")
    message = one_message(swash("identify", "--vehicle", "coax", "--flight", simulated, "--out", out))
    assert "expected a folder" in message
    assert out.read_text(encoding="utf-8") == "mine"


def test_an_option_of_one_value_is_not_given_twice() -> None:
    """Only the last would count, and nobody would be told."""
    assert "--speed: is given more than once" in one_message(
        swash("vehicle", "trim", "coax", "--speed", "1", "--speed=2")
    )
    twice = ("identify", "--responses", "responses", "--search", "--rename", "lateral=a", "--rename", "longitudinal=b")
    assert "--rename: is given more than once. Give its values once, by commas." in one_message(swash(*twice))


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("respond none.bin", "none.bin: there is no such file"),
        ("identify --flight none.bin@2-9", "none.bin: there is no such file"),
        ("identify --vehicle raptor5", "Did you mean 'raptor50'?"),
        ("export raptor5", "Did you mean 'raptor50'?"),
        ("control check raptor5", "Did you mean 'raptor50'?"),
        ("identify --responses none", "none: there is no such file"),
        ("vehicle stitch none.toml", "none.toml: there is no such file"),
        ("campaign run none.toml", "none.toml: there is no such file"),
        ("campaign report none", "none: there is no such file"),
        ("link accept none --vehicle raptor50", "none: there is no such file"),
        ("respond coax56/none", "has no file 'none'"),
        ("export raptor50", "Missing option '--format'"),
        ("respond", "Missing argument 'LOG...'"),
    ],
)
def test_what_was_typed_is_judged_before_what_was_not(line: str, named: str) -> None:
    done = swash(*line.split())
    assert done.code == 2
    assert named in done.err


def test_a_compiler_that_refuses_a_filter_makes_one_message(simulated: Path, tmp_path: Path) -> None:
    """It answers well when it is tried, and not when it counts."""
    there = compiler()
    if there is None:
        pytest.skip("there is no C compiler")
    script = f"""#!/bin/sh
for each in "$@"; do
  case "$each" in *.c) if grep -q run_along "$each"; then echo "error: not today" >&2; exit 1; fi;; esac
done
exec {" ".join(there)} "$@"
"""
    (tmp_path / "cc").write_text(script)
    (tmp_path / "cc").chmod(0o755)
    path, out = f"{tmp_path}{os.pathsep}{os.environ['PATH']}", tmp_path / "out"
    asked = ("--vehicle", "coax", "--flight", simulated, "--free", "flight", "--quiet", "--out", out)
    message = one_message(swash_process("identify", *asked, PATH=path))
    assert "refused" in message
    assert "not today" in message
    assert not out.exists()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("vehicle trim raptor50 --speed 1e308", "--speed: is 1e+308, expected -340 to 340 m/s"),
        ("vehicle trim raptor50 --settings turn=1e308", "turn: is 1e+308, expected -1000 to 1000 deg/s"),
        ("vehicle linearize raptor50 --settings voltage=1e308", "voltage: is 1e+308, expected 0 to 1000 V"),
        ("control design coax --rate 1e308", "--rate: is 1e+308, expected 1 to 10000 Hz"),
        ("control gains raptor50 --settings rate=1e308", "rate: is 1e+308, expected 50 to 32000 Hz"),
        (
            "identify --vehicle coax --flight none.nc --horizon 0.25,1e308",
            "--horizon: is 1e+308, expected 0.001 to 600",
        ),
        ("identify --vehicle coax --flight none.nc --outputs ", "--outputs: is empty"),
        ("identify --vehicle coax --flight none.nc --free ", "--free: is empty"),
        ("inspect none.bin --channels p", "--channels: says what a figure shows. Add --out FILE.html"),
    ],
)
def test_numbers_without_sense_and_empty_names_are_refused_at_once(line: str, words: str) -> None:
    assert words in one_message(swash(*line.split(" ")))


def test_the_folder_where_one_stands_may_be_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = swash("vehicle", "trim", "raptor50", "--speed", "0-4/2", "--out", ".")
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out.rstrip().endswith("Report: report.html")
    assert (tmp_path / "report.html").is_file()


@pytest.mark.parametrize("line", ["inspect none.bin", "control gains raptor50", "control decouple coax"])
def test_a_folder_is_refused_where_only_files_are_written(line: str, tmp_path: Path) -> None:
    for out in (tmp_path, tmp_path / "new"):
        assert "is a folder's name, expected one of ." in one_message(swash(*line.split(" "), "--out", out))
    assert not list(tmp_path.iterdir())
