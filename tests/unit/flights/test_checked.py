"""A log that is taken to work keeps what is wrong with the channels that are used, through conditioning and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from swashplate.errors import FlightError
from swashplate.flights.checked import checked
from swashplate.flights.conditioning.uniform_records import uniform_records
from swashplate.flights.flight import Flight
from swashplate.identification.core.sources import hashes as hashes_of
from swashplate.identification.core.sources import problem_words, scale_words, source_of, sources_named, sources_of

TIME = np.arange(0.0, 60.0, 0.02)


def log(*, p: float = 1.0, q: float = 1.0, still: str = "mixer_yaw") -> Flight:
    """Roll and pitch in turn with their rates times a factor, a gap, and a command that never moves."""
    rng = np.random.default_rng(1)
    phi, theta = 0.2 * np.sin(2.1 * TIME), 0.15 * np.sin(3.3 * TIME + 1.0)
    noise = 0.002 * rng.standard_normal((2, TIME.size))
    channels = {"phi": phi, "theta": theta, still: np.full(TIME.size, 0.1), "mixer_roll": np.cos(2.0 * TIME)}
    channels |= {"p": p * (np.gradient(phi, TIME) + noise[0]), "q": q * (np.gradient(theta, TIME) + noise[1])}
    stamps = np.where(TIME < 30.0, TIME, TIME + 0.2)
    return Flight.from_arrays(stamps, channels, source="log.csv")


def texts(flight: Flight) -> list[str]:
    return [problem.text for problem in flight.provenance.problems]


def test_problems_are_those_of_the_channels_that_are_used() -> None:
    assert [text.split(":")[0] for text in texts(checked(log(q=1.25)))] == ["q", "arrays", "mixer_yaw"]
    (gap,) = texts(checked(log(q=1.25), {"p", "mixer_roll"}))
    assert gap.startswith("arrays: 1 gap")
    scaled, _ = checked(log(p=1.25), {"p", "mixer_roll"}).provenance.problems
    assert scaled.scale == pytest.approx((1.25, 0.0), abs=0.01)
    # An angle that is used may be the wrong one of the two.
    assert any("q: is 1.2" in text for text in texts(checked(log(q=1.25), {"theta"})))


def test_contradictions_of_channels_that_are_used_stop_the_work() -> None:
    turned = log(p=-1.0)
    for used in (None, {"p"}, {"phi", "mixer_roll"}):
        with pytest.raises(FlightError, match=r"p: has the other sign.*--as-logged"):
            checked(turned, used)
    assert len(texts(checked(turned, {"q", "mixer_roll"}))) == 1
    assert any("has the other sign" in text for text in texts(turned.condition(check=False, trim_ground=False)))


def test_they_go_through_conditioning_into_files_and_sources(tmp_path: Path) -> None:
    (made,) = uniform_records(log(p=1.25), ("p", "mixer_roll"), rate=50.0)
    assert len(made.provenance.problems) == 2
    assert sp.read(made.save(tmp_path / "made.nc")).provenance.problems == made.provenance.problems
    assert source_of(made).problems == made.provenance.problems
    (words,) = scale_words(sources_of([made]))
    assert words.startswith("log.csv: p: is 1.2")
    (others,) = problem_words(sources_of([made]))
    assert others.startswith("log.csv: arrays: 1 gap")
    # A response keeps the hashes of its logs, and their problems; pieces of one log tell them once.
    named = sources_named(["log.csv 0.00-30.00 s", "log.csv 30.20-60.00 s"], hashes_of([made]))
    assert scale_words(named) == (words,)
    assert problem_words(named) == (others,)


def test_fits_and_pages_carry_a_wrong_scale() -> None:
    scaled = log(p=1.25)
    found = sp.respond(uniform_records(scaled, ("p", "mixer_roll"), rate=50.0), inputs=["mixer_roll"], outputs=["p"])
    assert any("p: is 1.2" in text for text in found.problems)
    assert any("1 gap" in text for text in found.warnings)
    right = sp.respond(uniform_records(log(), ("p", "mixer_roll"), rate=50.0), inputs=["mixer_roll"], outputs=["p"])
    assert not any("wrong scale" in text for text in (*right.problems, *right.warnings))
