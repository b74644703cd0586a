"""`swash respond`, `fit-tf`, `fit-ss` and `validate` on linear models: files, messages and exit codes."""

from __future__ import annotations

import json
import signal as signals
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from commands import one_message, saying, swash
from scipy import signal

from swashplate.cli.console import Progress
from swashplate.flights.maneuvers.series import parse as maneuver
from swashplate.identification.time.linear_simulation import delayed
from swashplate.models.linear.state_space_file import structure
from swashplate.simulation.discretisation import first_order_hold

RATE = 100.0
TRUTH = {
    "Lb": 3000.0, "Ma": 800.0, "tau_f": 0.07, "Ba": 0.5, "Ab": -0.5, "Blat": 0.2, "Blon": -0.05, "Alat": 0.05,
    "Alon": 0.25, "tau_roll": 0.05, "tau_pitch": 0.05,
}  # fmt: skip


def log(
    path: Path, *, seed: int, dead: bool = False, doubled: bool = False, swept: bool = False, seconds: float = 120.0
) -> Path:
    """A CSV log of a four-state helicopter shaken on both axes, or swept one after the other, with noise."""
    random = np.random.default_rng(seed)
    n = round(seconds * RATE)
    u = 0.05 * signal.lfilter([0.2], [1.0, -0.8], random.standard_normal((n, 2)), axis=0)
    u[:, 1] = 0.0 if dead else 0.5 * u[:, 0] if doubled else u[:, 1] + 0.4 * u[:, 0]
    if swept:
        half = np.arange(n // 2) / RATE
        sweep = maneuver(f"sweep:mixer_roll,0.2-12Hz,{half[-1] - 4.0:.0f}s,0.05").signals(half - 2.0)["mixer_roll"]
        u = np.zeros((n, 2))
        u[: n // 2, 0], u[n - n // 2 :, 1] = sweep, sweep
    a, b, c, _ = structure("rotor_body").with_values(TRUTH).explicit()
    phi, q0, q1 = first_order_hold(a, b, 1 / RATE)
    late = np.column_stack([delayed(column, 5.0) for column in u.T])
    x = np.zeros((n, 4))
    for k in range(1, n):
        x[k] = phi @ x[k - 1] + q0 @ late[k - 1] + q1 @ (late[k] - late[k - 1])
    y = x @ c.T + 0.002 * random.standard_normal((n, 2))
    head = "time [s],mixer_roll [1],mixer_pitch [1],p [rad/s],q [rad/s]"
    np.savetxt(path, np.column_stack([np.arange(n) / RATE, u, y]), delimiter=",", header=head, comments="", fmt="%.9g")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sweeps")


@pytest.fixture(scope="module")
def flown(folder: Path) -> Path:
    return log(folder / "flown.csv", seed=1)


@pytest.fixture(scope="module")
def answered(folder: Path, flown: Path) -> Path:
    out = folder / "responses"
    done = swash(
        "respond", flown, "--inputs", "mixer_roll,mixer_pitch", "--outputs", "p,q", "--band", "0.2-12", "--out", out
    )
    assert done.code == 0, done.err
    assert "p / mixer_roll" in done.out
    assert {file.name for file in out.iterdir()} == {"responses.nc", "responses.json", "report.html"}
    read = json.loads((out / "responses.json").read_text(encoding="utf-8"))["handling"]
    assert [(one["response"], one["from"]) for one in read] == [
        ("phi / mixer_roll", "flight"), ("theta / mixer_pitch", "flight"),
    ]  # fmt: skip
    return out


@pytest.fixture(scope="module")
def swept(folder: Path) -> Path:
    """Responses of a log that sweeps one axis after the other: gains need an input that was moved from outside."""
    flight, out = log(folder / "swept.csv", seed=5, swept=True), folder / "swept"
    asked = ("--inputs", "mixer_roll,mixer_pitch", "--outputs", "p,q", "--band", "0.3-11", "--out", out)
    assert swash("respond", flight, *asked).code == 0
    return out


def test_from_a_log_to_a_model_that_is_verified(folder: Path, swept: Path) -> None:
    out, unseen = folder / "model", log(folder / "unseen.csv", seed=2, seconds=40.0)
    done = swash(
        "identify", "--structure", "rotor_body", "--responses", swept, "--out", out, "--hold-out", unseen, "--gains"
    )
    assert done.code == 0, done.err
    assert "ATC_RAT_RLL_FF" in done.out
    fit = json.loads((out / "fit.json").read_text(encoding="utf-8"))
    found = {p["name"]: p["value"] for p in fit["estimates"]}
    assert found["Lb"] == pytest.approx(3000.0, rel=0.05)
    assert found["tau_roll"] == pytest.approx(0.05, abs=0.003)
    verification = json.loads((out / "verification.json").read_text(encoding="utf-8"))
    assert verification["J_rms"] < 0.5
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Which gains, with which margins?" in page
    assert page.count("fitted-responses") > 0
    again = swash("validate", "--vehicle", out / "model.toml", "--flight", unseen, "--out", folder / "validated")
    assert again.code == 0, again.err
    assert "J_rms" in again.out
    assert (folder / "validated" / "report.html").is_file()


def test_transfer_functions_are_tried_and_saved(folder: Path, answered: Path) -> None:
    out = folder / "tf"
    done = swash("identify", "--responses", answered, "--input", "mixer_roll", "--outputs", "p", "--out", out, "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert len(document["tried"]) > 5
    assert max(document["fit"]["costs"].values()) < 50.0
    assert (out / "model.toml").is_file()
    fixed = swash(
        "identify",
        "--responses",
        answered,
        "--input",
        "mixer_roll",
        "--outputs",
        "p",
        "--form",
        "2/4",
        "--fix",
        "tau=0.05",
    )
    assert fixed.code == 0
    assert "fixed" in fixed.out
    (gain,) = (line for line in fixed.out.splitlines() if line.startswith("  K "))
    assert gain.endswith("rad/s^3")  # rad/s per 1, over two more poles than zeros


def test_responses_are_multiplied_divided_and_inverted(folder: Path, answered: Path) -> None:
    """A response over itself is one; what is combined goes on into the next command."""
    pair = f"{answered}:p/mixer_roll"
    inverse = swash("respond", pair, "--combine", "inverse", "--out", folder / "inverse")
    assert inverse.code == 0, inverse.err
    assert {file.name for file in (folder / "inverse").iterdir()} == {"responses.nc", "responses.json", "report.html"}
    one = swash("respond", pair, folder / "inverse", "--combine", "product", "--json")
    assert one.code == 0, one.err
    kept = json.loads((folder / "inverse" / "responses.json").read_text(encoding="utf-8"))
    assert json.loads(one.out).keys() == kept.keys()
    assert "mixer_roll / p" in inverse.out
    assert "Did you mean 'ratio'?" in one_message(swash("respond", pair, pair, "--combine", "ration"))
    assert "takes two responses" in one_message(swash("respond", pair, "--combine", "ratio"))
    assert "responses of one pair" in one_message(swash("respond", answered, "--combine", "inverse"))
    assert "no such file" in one_message(swash("respond", folder / "nothing.nc", "--combine", "inverse"))
    assert "it takes one or two" in one_message(swash("respond", pair, pair, pair, "--combine", "ratio"))


def test_transfer_functions_start_a_model_and_tell_margins(folder: Path, answered: Path) -> None:
    places = []
    for name, output in (("mixer_roll", "p"), ("mixer_pitch", "q")):
        places.append(folder / f"tf_{output}")
        done = swash(
            "identify",
            "--responses",
            answered,
            "--input",
            name,
            "--outputs",
            output,
            "--form",
            "2/4",
            "--margins",
            "--out",
            places[-1],
        )
        assert done.code == 0, done.err
        assert f"{output} / {name} (flight): crossover" in done.out
        assert f"{output} / {name} (model): crossover" in done.out
        assert f"{ {'p': 'phi', 'q': 'theta'}[output] } / {name} (model): bandwidth" in done.out
        assert "+- 0 " not in done.out
    done = swash(
        "identify",
        "--structure",
        "rotor_body",
        "--responses",
        answered,
        "--start-from",
        ",".join(map(str, places)),
        "--json",
    )
    assert done.code == 0, done.err
    found = {p["name"]: p["value"] for p in json.loads(done.out)["fit"]["estimates"]}
    assert found["Lb"] == pytest.approx(3000.0, rel=0.05)
    refused = swash(
        "identify", "--structure", "rotor_body", "--responses", answered, "--start-from", str(folder / "nothing.toml")
    )
    assert "neither a vehicle's name nor a file" in one_message(refused)


def test_gains_come_from_transfer_functions_too_and_their_lack_is_said(swept: Path) -> None:
    ask = ("identify", "--responses", swept, "--input", "mixer_roll", "--form", "2/4")
    done = swash(*ask, "--outputs", "p", "--gains", "--json")
    assert done.code == 0, done.err
    (roll,) = json.loads(done.out)["gains"]
    assert roll["parameters"]["ATC_RAT_RLL_FLTE"] == 20.0
    assert roll["margins"]["gain_margin"][0] >= 6.0
    assert roll["margins"]["gain_margin"][1] > 0.0
    assert roll["flown"] == {}  # a table holds no parameters of an autopilot
    assert "nothing to compare with" in roll["words"]
    assert "joins no rate with its mixer command" in one_message(swash(*ask, "--outputs", "q", "--gains"))
    own = swash(*ask, "--gains", "--json")
    assert own.code == 0, own.err
    assert [one["axis"] for one in json.loads(own.out)["gains"]] == [roll["axis"]], "the rate that it commands"
    unnamed = one_message(swash("identify", "--responses", swept, "--gains"))
    assert "--input: is missing. The responses have --input mixer_roll or mixer_pitch" in unnamed


def test_the_fitted_flight_is_no_hold_out(answered: Path, flown: Path) -> None:
    done = swash(
        "identify",
        "--structure",
        "rotor_body",
        "--responses",
        answered,
        "--hold-out",
        flown,
        "--settings",
        saying(starts=1),
    )
    assert "NOT A HOLD-OUT" in done.out


@pytest.mark.parametrize(("kind", "words"), [("dead", "'mixer_pitch' never moves"), ("doubled", "move together")])
def test_a_dead_or_doubled_input_is_named_and_the_rest_is_kept(folder: Path, kind: str, words: str) -> None:
    bad = log(folder / f"{kind}.csv", seed=3, **{kind: True})  # type: ignore[arg-type]
    out = folder / kind
    done = swash(
        "respond", bad, "--inputs", "mixer_roll,mixer_pitch", "--outputs", "p,q", "--band", "0.2-10", "--out", out
    )
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err
    assert "NOT COMPUTED" in (out / "report.html").read_text(encoding="utf-8")


def test_noise_is_not_a_response(folder: Path) -> None:
    random = np.random.default_rng(4)
    rows = np.column_stack([np.arange(6000) / RATE, random.standard_normal((6000, 2))])
    path = folder / "noise.csv"
    np.savetxt(path, rows, delimiter=",", header="time [s],mixer_roll [1],p [rad/s]", comments="")
    done = swash("respond", path, "--inputs", "mixer_roll", "--outputs", "p", "--out", folder / "noise")
    assert done.code == 2
    assert "do not use its responses" in done.err
    refused = one_message(swash("identify", "--responses", folder / "noise", "--input", "mixer_roll", "--outputs", "p"))
    assert "p / mixer_roll" in refused


def test_what_a_user_can_get_wrong_is_said(folder: Path, flown: Path, answered: Path) -> None:
    ask = ("--inputs", "mixer_roll", "--outputs", "p")
    assert "named as a reference" in one_message(swash("respond", flown, *ask, "--references", "p"))
    assert "same stretch of the same log" in one_message(swash("respond", flown, flown, *ask))
    assert "shortest window 500 s" in one_message(swash("respond", flown, *ask, "--settings", saying(windows="500")))
    assert "is 0, expected 0.001 to 100000" in one_message(
        swash("respond", flown, *ask, "--settings", saying(windows="0"))
    )
    assert "the flight has no such channel" in one_message(
        swash("respond", flown, "--inputs", "stick", "--outputs", "p")
    )
    assert "Did you mean 'mixer_roll'?" in one_message(swash("respond", flown, "--inputs", "roll", "--outputs", "p"))
    assert "is not LOW-HIGH" in one_message(swash("respond", flown, *ask, "--band", "10-1"))
    assert "no such file" in one_message(
        swash("identify", "--responses", folder / "nothing.nc", "--input", "mixer_roll")
    )
    assert "does not hold frequency responses" in one_message(
        swash("identify", "--responses", flown, "--input", "mixer_roll")
    )
    assert "is no input of these responses" in one_message(
        swash("identify", "--responses", answered, "--input", "stick")
    )
    assert "neither a ready structure nor a file" in one_message(
        swash("identify", "--structure", "rotorbody", "--responses", answered)
    )
    assert "is no form" in one_message(
        swash("identify", "--responses", answered, "--input", "mixer_roll", "--form", "two")
    )
    bad = folder / "bad.toml"
    from importlib import resources

    text = (resources.files("swashplate.models.linear") / "structures" / "rotor_body.toml").read_text(encoding="utf-8")
    bad.write_text(text.replace('b = "Lb"', 'b = "Lbb"'), encoding="utf-8")
    message = one_message(swash("identify", "--structure", bad, "--responses", answered))
    assert "'Lbb'" in message
    bad.write_text(text.replace('b = "Lb"', 'b = "Lb/0"'), encoding="utf-8")
    assert "divides by zero" in one_message(swash("identify", "--structure", bad, "--responses", answered))
    fixed = [word for name in structure("rotor_body").free for word in ("--fix", f"{name}=0.3")]
    assert "every parameter is fixed" in one_message(
        swash("identify", "--structure", "rotor_body", "--responses", answered, *fixed)
    )
    assert "Did you mean 'Lb'" in message
    assert "is no parameter" in one_message(
        swash("identify", "--structure", "rotor_body", "--responses", answered, "--start", "Lbb=3")
    )
    for option in ("--start", "--fix"):
        outside = one_message(
            swash("identify", "--structure", "rotor_body", "--responses", answered, option, "tau_f=-1")
        )
        assert "tau_f: is given as -1, expected 0.002 to 1 s" in outside
    ask = ("identify", "--responses", answered, "--input", "mixer_roll", "--outputs", "p", "--form", "1/2", "--fix")
    for held, words in (
        ("tau=-1", "expected 0 to 0.5 s"), ("omega_pole=-3", "expected above 0 rad/s"),
        ("zeta_pole=-3", "expected -2 to 10 in the form 1/2"), ("K=0", "expected other than 0"),
    ):  # fmt: skip
        assert words in one_message(swash(*ask, held))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'Ba = {value = 0.0, unit = "1"}',
            'Ba = {value = 0.0, unit = "furlong"}',
            "parameters.Ba.unit: unit 'furlong'",
        ),
        ('b = "rad"', 'b = "1/fortnight"', "states.b: unit '1/fortnight' is not known"),
        ('b = "rad"', "b = 3", "states.b: unit 3 is not known"),
        ('mixer_roll = "1"\n', 'mixer_roll = "%"\n', "inputs.mixer_roll: unit is '%', expected '1'"),
        (
            '[outputs.p]\nunit = "rad/s"',
            '[outputs.p]\nunit = "deg/s"',
            "outputs.p.unit: unit is 'deg/s', expected 'rad/s'",
        ),
    ],
)
def test_a_unit_that_is_none_is_named(folder: Path, answered: Path, old: str, new: str, words: str) -> None:
    from importlib import resources

    ready = (resources.files("swashplate.models.linear") / "structures" / "rotor_body.toml").read_text("utf-8")
    assert old in ready
    bad = folder / "unit.toml"
    bad.write_text(ready.replace(old, new, 1), encoding="utf-8")
    assert words in one_message(swash("identify", "--structure", bad, "--responses", answered))


def test_single_pairs_have_bands_of_their_own_or_are_left_out(answered: Path) -> None:
    ask = ("identify", "--structure", "rotor_body", "--responses", answered, "--json", "--settings", saying(starts=1))
    done = swash(*ask, "--band", "0.3-10", "--band", "p/mixer_roll=0.5,8", "--settings", "without=q/mixer_roll")
    assert done.code == 0, done.err
    fit = json.loads(done.out)["fit"]
    assert set(fit["costs"]) == {"p / mixer_roll", "p / mixer_pitch", "q / mixer_pitch"}
    assert fit["settings"]["bands_hz"] == {"p/mixer_roll": [0.5, 8.0]}
    assert "Did you mean 'p/mixer_roll'?" in one_message(swash(*ask, "--band", "p/mixer_rol=1-2"))
    assert "Did you mean 'q/mixer_roll'?" in one_message(swash(*ask, "--settings", "without=q/mixerroll"))
    assert "two bands are given for all pairs" in one_message(swash(*ask, "--band", "1-2", "--band", "1-3"))
    assert "is not LOW-HIGH" in one_message(swash(*ask, "--band", "p/mixer_roll=5"))


def test_structures_are_listed_shown_composed_and_searched(folder: Path, answered: Path) -> None:
    listed = swash("vehicle", "structures")
    assert listed.code == 0
    assert "rotor_body" in listed.out
    assert "Pitt-Peters" in listed.out
    assert json.loads(swash("vehicle", "structures", "--json").out)["parts"]["torque"].startswith("engine")
    out = folder / "composed.toml"
    shown = swash("vehicle", "structures", "compose:cyclic+flap", "--out", out)
    assert shown.code == 0, shown.err
    assert "tau_f db/dt = -tau_f p + Ba a - b + Blat lateral + Blon longitudinal" in shown.out
    assert structure(str(out)).name == "cyclic+flap"
    assert "exists already" in one_message(swash("vehicle", "structures", "compose:cyclic+flap", "--out", out))
    assert "Did you mean 'flap'?" in one_message(swash("vehicle", "structures", "compose:cyclic+flapp"))
    names = ("--rename", "lateral=mixer_roll,longitudinal=mixer_pitch")
    fitted = swash("identify", "--structure", out, "--responses", answered, *names, "--json")
    assert fitted.code == 0, fitted.err
    found = {p["name"]: p["value"] for p in json.loads(fitted.out)["fit"]["estimates"]}
    assert found["Lb"] == pytest.approx(3000.0, rel=0.05)
    assert "Say --rename lateral=mixer_roll" in one_message(
        swash("identify", "--structure", out, "--responses", answered)
    )
    some = "compose:cyclic,compose:cyclic+flap_decoupled,compose:cyclic+flap"
    searched = swash(
        "identify", "--structure", some, "--responses", answered, "--search", *names, "--out", folder / "searched"
    )
    assert searched.code == 0, searched.err
    assert "*cyclic+flap " in searched.out
    assert "Picked cyclic+flap" in searched.out
    assert "Which structures were tried?" in (folder / "searched" / "report.html").read_text(encoding="utf-8")
    assert "--flight: is missing" in one_message(swash("identify", "--structure", answered))


def test_an_unstable_start_is_named_and_the_fit_is_kept(folder: Path, answered: Path) -> None:
    text = folder / "unstable.toml"
    from importlib import resources

    ready = (resources.files("swashplate.models.linear") / "structures" / "rotor_body.toml").read_text(encoding="utf-8")
    text.write_text(
        ready.replace('Lb = {value = 1000.0, unit = "1/s^2", lower = 0.0}', "Lb = {value = -1000.0}"), encoding="utf-8"
    )
    out = folder / "unstable"
    done = swash("identify", "--structure", text, "--responses", answered, "--out", out, "--settings", saying(starts=1))
    assert done.code == 2
    assert "is unstable" in done.err
    assert (out / "fit.json").is_file()


def test_a_record_in_two_rates_is_brought_to_one(folder: Path, flown: Path) -> None:
    rows = np.loadtxt(flown, delimiter=",", skiprows=1)[::2]
    slow = folder / "slow.csv"
    np.savetxt(slow, rows, delimiter=",", header=flown.read_text(encoding="utf-8").splitlines()[0], comments="")
    done = swash(
        "respond",
        flown,
        slow,
        "--inputs",
        "mixer_roll,mixer_pitch",
        "--outputs",
        "p,q",
        "--band",
        "0.2-8",
        "--rate",
        "50",
    )
    assert done.code == 0, done.err


def test_a_model_is_fitted_in_time_and_verified_on_another_log(folder: Path, flown: Path) -> None:
    out, unseen = folder / "time", log(folder / "unseen_time.csv", seed=7, seconds=15.0)
    short = log(folder / "short.csv", seed=8, seconds=12.0)
    done = swash(
        "identify", "--structure", "rotor_body", "--flight", short, "--hold-out", unseen, "--out", out, "--start",
        "Lb=2000", "--start", "Blat=0.15", "--fix", "tau_pitch=0.05", "--settings",
        saying(iterations=25, shifts=False),
    )  # fmt: skip
    assert done.code == 0, done.err
    fit = json.loads((out / "fit.json").read_text(encoding="utf-8"))
    found = {p["name"]: p["value"] for p in fit["estimates"]}
    assert found["Lb"] == pytest.approx(3000.0, rel=0.05)
    assert found["tau_roll"] == pytest.approx(0.05, abs=0.002)
    assert json.loads((out / "verification.json").read_text(encoding="utf-8"))["J_rms"] < 0.5
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "identified in time" in page
    assert "NOT A HOLD-OUT" not in page
    assert "method is 'magic'" in one_message(
        swash("identify", "--structure", "rotor_body", "--flight", short, "--method", "magic")
    )
    assert "is no parameter" in one_message(
        swash("identify", "--structure", "rotor_body", "--flight", short, "--start", "Lbb=3")
    )


@pytest.mark.parametrize("number", [signals.SIGINT, signals.SIGTERM])
def test_a_stopped_fit_is_kept_as_far_as_it_came(
    folder: Path, monkeypatch: pytest.MonkeyPatch, number: signals.Signals
) -> None:
    short = log(folder / "short.csv", seed=8, seconds=12.0)
    ask = (
        "identify",
        "--structure",
        "rotor_body",
        "--flight",
        short,
        "--start",
        "Lb=2000",
        "--start",
        "Blat=0.15",
        "--settings",
        saying(shifts=False),
    )
    two, out, none = folder / "two", folder / f"stopped_{number}", folder / f"none_{number}"
    assert swash(*ask, "--settings", "iterations=2", "--out", two).code == 0
    # As the console script has them, also where a shell in the background had SIGINT ignored.
    before = signals.signal(signals.SIGTERM, lambda *_: sys.exit(128 + signals.SIGTERM))
    ignored = signals.signal(signals.SIGINT, signals.default_int_handler)

    def stopping_at(words: str) -> Callable[..., None]:
        def say(self: Progress, what: str, *, note: str = "", **_: object) -> None:
            if words in (note.partition(",")[0], what if not note else ""):
                signals.raise_signal(number)

        return say

    try:
        monkeypatch.setattr(Progress, "say", stopping_at("iteration 2"))
        done = swash(*ask, "--out", out)
        monkeypatch.setattr(Progress, "say", stopping_at("fitting"))
        ended = swash(*ask, "--out", none)
    finally:
        signals.signal(signals.SIGTERM, before)
        signals.signal(signals.SIGINT, ignored)
    assert done.code == 128 + number
    assert f"stopped after 2 iterations by {number.name}" in done.err
    fit, same = (json.loads((place / "fit.json").read_text(encoding="utf-8")) for place in (out, two))
    assert [p["value"] for p in fit["estimates"]] == [p["value"] for p in same["estimates"]]
    assert not fit["converged"]
    assert fit["problems"][0].startswith("stopped after 2 iterations")
    assert (out / "model.toml").read_bytes() == (two / "model.toml").read_bytes()
    assert ended.code == 128 + number
    assert not none.exists()


def test_a_channel_of_another_name_is_flown_along_where_asked_or_where_the_responses_say_so(
    folder: Path,
) -> None:
    other = log(folder / "other.csv", seed=6, seconds=40.0)
    other.write_text(other.read_text(encoding="utf-8").replace(",p [rad/s]", ",p_gyro [rad/s]"), encoding="utf-8")
    renamed = folder / "renamed"
    ask = ("--inputs", "mixer_roll,mixer_pitch", "--outputs", "p=p_gyro,q", "--band", "0.2-12")
    assert swash("respond", other, *ask, "--out", renamed).code == 0
    fitted = swash(
        "identify",
        "--structure",
        "rotor_body",
        "--responses",
        renamed,
        "--hold-out",
        other,
        "--out",
        renamed,
        "--settings",
        saying(starts=1),
    )
    assert fitted.code == 0, fitted.err
    checked = ("validate", "--vehicle", renamed / "model.toml", "--flight", other)
    assert "  p   " not in swash(*checked).out
    done = swash(*checked, "--settings", "rename=p=p_gyro")
    assert done.code == 0, done.err
    assert "  p   " in done.out
    assert "Did you mean 'p_gyro'?" in one_message(swash(*checked, "--settings", "rename=p=p_gyr"))
