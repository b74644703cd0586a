"""The page's law of the rate loop is Python's: the same figures and answers to 1e-9, for any gains."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `live` is not installed")

from test_open_in_chromium import served

import chromium
from swashplate.control.analysis.ardupilot_gains import Suggestion, suggest_gains
from swashplate.control.analysis.gain_changes import gain_changes
from swashplate.control.analysis.rate_gain_names import short
from swashplate.control.analysis.rate_loop_steps import rate_loop_steps
from swashplate.json_text import plain
from swashplate.links.logs.loop_page import loop_of
from swashplate.links.web.libraries import PAGE
from swashplate.models.linear.state_space_file import structure

CLOSE = 1e-9


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    if not (PAGE / "vendor" / "uPlot.esm.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    browsers = chromium.running_browser()
    browser = next(browsers)
    with served(cwd=tmp_path_factory.mktemp("loop")) as url:
        made = browser.new_page()
        made.goto(url)
        yield made
        made.close()
    browsers.close()


SITL = {
    "Lb": 3588.6, "Ma": 617.5, "tau_f": 0.068232, "Ba": 1.2963, "Ab": -1.3402, "Blat": 0.24493, "Blon": -0.08487,
    "Alat": 0.07285, "Alon": 0.26962, "tau_roll": 0.0534, "tau_pitch": 0.0526,
}  # fmt: skip
ARDUPILOT = {
    "ATC_RAT_RLL_P": 0.06, "ATC_RAT_RLL_I": 0.105, "ATC_RAT_RLL_D": 0.002, "ATC_RAT_RLL_FF": 0.21,
    "ATC_RAT_RLL_FLTT": 10.0, "ATC_RAT_RLL_FLTE": 20.0, "ATC_RAT_RLL_FLTD": 15.0, "INS_GYRO_FILTER": 20.0,
}  # fmt: skip
ROTORFLIGHT = {
    "roll_p_gain": 50.0, "roll_i_gain": 100.0, "roll_d_gain": 20.0, "roll_f_gain": 100.0, "roll_gyro_cutoff": 50.0,
    "roll_d_cutoff": 15.0,
}  # fmt: skip
CASES = {
    "ArduPilot": (ARDUPILOT, {}),
    "a rate before the gyro's filter": (ARDUPILOT, {"p": "p_sid", "q": "q_sid"}),
    "Rotorflight": (ROTORFLIGHT, {}),
}


def suggestion_of(case: str) -> Suggestion:
    autopilot, sources = CASES[case]
    return suggest_gains(structure("rotor_body").with_values(SITL), autopilot=autopilot, sources=sources)[0]


@pytest.mark.parametrize("case", CASES)
def test_figures_and_answers_are_pythons(case: str, page: Any) -> None:
    """Flown gains, suggested ones, and twelve others by chance: soft, hard, unstable, without one or another part."""
    suggestion, random = suggestion_of(case), np.random.default_rng(11)
    loop, told = suggestion.loop, plain(loop_of(suggestion))
    assert (loop.gyro_filter > 0.0) is (case == "a rate before the gyro's filter")
    sets = [suggestion.flown, suggestion.parameters]
    for _ in range(12):
        scale = np.exp(random.uniform(-2.0, 2.5, len(suggestion.parameters))) * (random.random() < 0.9)
        sets.append({n: v * float(k) for (n, v), k in zip(suggestion.parameters.items(), scale, strict=True)})
    sets.append({n: v * (1.0 if "FLT" in n or "cutoff" in n else 60.0) for n, v in suggestion.parameters.items()})
    omega = np.asarray(told["loop"]["omega"])
    unstable = 0
    for gains in sets:
        page.evaluate(
            """async ([of, k]) => { window.made = (await import("/open/loop.js")).figures(of, k); }""",
            [told["loop"], short(gains)],
        )
        made = page.evaluate("""() => { const { loop, ...rest } = window.made; return rest; }""")
        right = loop.figures(gains, omega)
        read = right.margins
        expected = {
            "crossover": read.crossover.value, "phase_margin": read.phase_margin.value,
            "gain_margin": read.gain_margin.value, "delay_margin": read.delay_margin.value, "peak": right.peak,
            "bandwidth": right.bandwidth, "rejection": right.rejection, "overshoot": right.overshoot,
            "shaken": right.shaken, "left": right.left, "noise": right.noise,
        }  # fmt: skip
        for name, value in expected.items():
            assert made[name] == pytest.approx(value, rel=CLOSE, abs=CLOSE, nan_ok=True), (name, gains)
        if not {"P", "I", "D", "FF"} & set(short(gains)):
            continue
        answer = rate_loop_steps(
            loop.structure, gains, rate=loop.rate, command=loop.command, gyro_filter=loop.gyro_filter
        )
        for name, values in (("step", answer.step), ("disturbance", answer.disturbance)):
            scale = max(1.0, float(np.nanmax(np.abs(values))))
            assert np.asarray(made[name]) / scale == pytest.approx(values / scale, rel=CLOSE, abs=CLOSE, nan_ok=True)
        assert made["stable"] is answer.stable
        unstable += not answer.stable
    assert 0 < unstable < len(sets), "both kinds were among them"


@pytest.mark.parametrize("case", ["ArduPilot", "Rotorflight"])
def test_what_changes_is_named_as_python_names_it(case: str, page: Any) -> None:
    suggestion = suggestion_of(case)
    told, sets = plain(loop_of(suggestion)), (suggestion.flown, suggestion.parameters)
    ask = """async ([of, before, after]) => {
        const { changes, figures } = await import("/open/loop.js");
        return changes(figures(of, before), figures(of, after));
    }"""
    made = page.evaluate(ask, [told["loop"], *(short(gains) for gains in sets)])
    omega = np.asarray(told["loop"]["omega"])
    right = gain_changes(*(suggestion.loop.figures(gains, omega) for gains in sets))
    assert [(one["words"].replace("→", "->"), one["good"]) for one in made] == right
    assert right, "the two differ"


def test_the_sentence_says_what_it_buys_or_that_nothing_needs_changing() -> None:
    told = loop_of(suggestion_of("ArduPilot"))
    assert told["words"].startswith("The suggestion buys ")
    same = suggestion_of("ArduPilot")
    best = suggest_gains(structure("rotor_body").with_values(SITL), autopilot=same.parameters)[0]
    assert best.parameters == best.flown
    assert loop_of(best)["words"].startswith("Nothing needs changing.")


def test_the_names_and_units_are_the_firmwares() -> None:
    told = loop_of(suggestion_of("Rotorflight"))
    assert told["cli"]
    by_short = {gain["short"]: gain for gain in told["gains"]}
    assert by_short["P"]["name"] == "roll_p_gain"
    assert by_short["P"]["unit"] == pytest.approx(np.degrees(6.66666e-6))
    assert by_short["FLTG"]["unit"] == 1.0
