"""Responses, fits and models side by side: equal ones are alike, changed ones are told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import SwashError
from swashplate.flights.flight import Flight
from swashplate.models.linear.linear_vehicle import linear_vehicle
from swashplate.models.linear.state_space_file import parse
from swashplate.reporting.case_parts import match

MODEL = """
kind = "state-space"
name = "{name}"
[states]
p = "rad/s"
a = "rad"
[inputs]
lateral = "1"
[equations]
p = {{p = "Lp", a = "La"}}
a = {{a = "-10", lateral = "{gain}"}}
[outputs.p]
of = {{p = "1"}}
[delays]
lateral = "{delay}"
[parameters]
Lp = {{value = {lp}, unit = "1/s"}}
La = {{value = 80.0, unit = "1/s^2"}}
"""


def model(name: str = "one", *, lp: float = -4.0, gain: float = 1.0, delay: float = 0.02) -> sp.Vehicle:
    return linear_vehicle(parse(MODEL.format(name=name, lp=lp, gain=gain, delay=delay)))


def flown(seed: int, *, gain: float = 1.0, output: str = "p") -> Flight:
    """A first-order roll response with noise."""
    rng = np.random.default_rng(seed)
    stick = np.repeat(rng.choice((-1.0, 1.0), 300), 10)
    p = np.convolve(stick, 8.0 / 50.0 * np.exp(-4.0 * np.arange(100) / 50.0))[:3000]
    p = gain * p + 0.2 * rng.standard_normal(3000)
    return Flight.from_arrays(np.arange(3000) / 50.0, {"lateral": stick, output: p}, source=f"log {seed}")


@pytest.fixture(scope="module")
def responses() -> list[sp.FrequencyResponse]:
    logs = (flown(1), flown(2), flown(3, gain=1.3))
    return [sp.respond(log, inputs=["lateral"], outputs=["p"]) for log in logs]


def test_responses_that_only_chance_parts_are_one_sigma_away(responses: list[sp.FrequencyResponse]) -> None:
    found = sp.compare({"first": responses[0], "again": responses[1], "louder": responses[2]})
    told = found.to_document()["responses"]["p/lateral"]
    assert 0.5 < told["again"]["sigmas"] < 1.6
    assert told["louder"]["sigmas"] > 2.0
    assert told["louder"]["magnitude"] == pytest.approx(20.0 * np.log10(1.3), abs=0.4)
    assert told["again"]["J"] < 50.0 < 100.0 < told["louder"]["J"]
    assert [text for text in found.to_document()["remarks"] if "louder differs" in text]
    assert not [text for text in found.to_document()["remarks"] if "again" in text]
    assert found.figures == ("overlay",)
    assert "p / lateral" in repr(found)


def test_fits_are_told_apart_by_their_sigmas(responses: list[sp.FrequencyResponse]) -> None:
    fits = [sp.fit_transfer_function(one, "0/1", input="lateral") for one in responses]
    found = sp.compare({"first": fits[0], "again": fits[1], "louder": fits[2]})
    gains = found.to_document()["parameters"]["K"]
    assert abs(gains["again"]["away"]) < 3.0 < gains["louder"]["away"]
    spread = np.hypot(gains["first"]["sigma"], gains["louder"]["sigma"])
    assert gains["louder"]["away"] == pytest.approx((gains["louder"]["value"] - gains["first"]["value"]) / spread)
    assert [t for t in found.to_document()["remarks"] if t.startswith("K: louder differs from first by")]
    assert not [t for t in found.to_document()["remarks"] if "again differs" in t]
    same = sp.compare({"a": fits[0], "b": fits[0]})
    assert [t for t in same.to_document()["remarks"] if "have seen the same data" in t]
    assert not [t for t in found.to_document()["remarks"] if "same data" in t]


def test_models_show_modes_and_mismatch() -> None:
    found = sp.compare([model(), model("slow", lp=-2.0), model("late", delay=0.06)])
    document = found.to_document()
    assert document["cases"] == ["one", "slow", "late"]
    assert [entry["one"] for entry in document["modes"]] == [[-10.0, 0.0], [-4.0, 0.0]]
    assert document["modes"][1]["slow"] == [-2.0, 0.0]
    mismatch = document["responses"]["p/lateral"]
    # A delay moves phases only: J = 20/n sum 0.01745 (degrees)^2, here with the weights of full coherence.
    omega = np.geomspace(0.1, 5.0, 60) * 2.0 * np.pi
    assert mismatch["late"] == pytest.approx(20.0 * np.mean(0.01745 * np.degrees(0.04 * omega) ** 2), rel=0.05)
    assert mismatch["slow"] > 50.0


def test_modes_are_matched_all_at_once() -> None:
    assert match([-10.0, -9.0], [-9.5, -12.0]) == [1, 0]
    assert match([-10.0, 1j], [-9.0]) == [0, None]
    assert match([], [-1.0]) == []


def test_a_louder_model_is_the_gain_squared_away() -> None:
    found = sp.compare({"a": model(), "b": model(gain=2.0)}).to_document()
    assert found["responses"]["p/lateral"]["b"] == pytest.approx(20.0 * (20.0 * np.log10(2.0)) ** 2, rel=0.05)
    assert all(entry["a"] == entry["b"] for entry in found["modes"])


def test_files_and_folders(tmp_path: Path, responses: list[sp.FrequencyResponse]) -> None:
    for name, one in zip(("x", "y"), responses, strict=False):
        (tmp_path / name).mkdir()
        one.save(tmp_path / name / "responses.nc")
        model(lp=-3.0).save(tmp_path / name / "model.toml")
    found = sp.compare([tmp_path / "x", tmp_path / "y"])
    assert (found.what, found.names) == ("responses", ("x", "y"))
    models = sp.compare([str(tmp_path / "x" / "model.toml"), tmp_path / "y" / "model.toml"])
    assert models.names == ("x/model.toml", "y/model.toml")
    page = sp.report(models, path=tmp_path / "page.html")
    assert "Mismatch J" in page.read_text()
    assert found.save(tmp_path / "found.json").is_file()


def test_what_cannot_be_compared(tmp_path: Path, responses: list[sp.FrequencyResponse]) -> None:
    other = sp.respond(flown(4, output="q"), inputs=["lateral"], outputs=["q"])
    refused = {
        "1 given, expected two or more": lambda: sp.compare([model()]),
        "stand beside what is none": lambda: sp.compare([responses[0], model()]),
        "share no pair": lambda: sp.compare([responses[0], other]),
        "Give flights too": lambda: sp.compare([model(), model()], outputs=["p"]),
        "has none of responses.nc": lambda: sp.compare([tmp_path, tmp_path]),
        "is neither a vehicle's name nor a file": lambda: sp.compare([tmp_path / "gone.toml", model()]),
    }
    for words, call in refused.items():
        with pytest.raises(SwashError, match=words):
            call()
