"""Sweeps seen in signals: how often noise is taken for one, and how often one is missed."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import gusty_sweeps
import proof_page
import r50
from coloured_noise import coloured, resonance
from swashplate.arrays import Array
from swashplate.flights.maneuvers import sweeps as sweeps_module
from swashplate.flights.maneuvers.series import parse
from swashplate.flights.maneuvers.sweeps import all_rising, sweeps

RATES = (10, 25, 50, 100, 400)
PROGRAMS = (("0.1-6", 90), ("0.3-10", 60), ("0.5-8", 30), ("0.2-4", 60), ("1-20", 20))
Record = tuple[Array, Array]


def quiet(rate: int, seconds: int, seeds: Sequence[int]) -> Iterator[Record]:
    """Noise of random spectra without a sweep."""
    for seed in seeds:
        random = np.random.default_rng([11, rate, seconds, seed])
        count = seconds * rate
        yield np.arange(count) / rate, coloured(random, count, rate=rate)


def ringing(seeds: Sequence[int]) -> Iterator[Record]:
    """What is taken for a sweep most easily: slow logs of a resonance that is damped a little."""
    for seed in seeds:
        random = np.random.default_rng([12, seed])
        hertz, damping = random.uniform(0.5, 2.0), random.uniform(0.2, 0.7)
        yield np.arange(1800) / 10.0, resonance(random, 1800, rate=10.0, hertz=hertz, damping=damping)


def false_alarms(records: Iterator[Record]) -> tuple[int, float]:
    """Sweeps that are seen, and the hours."""
    count, hours = 0, 0.0
    for time, values in records:
        count += len(all_rising(time, values))
        hours += float(time[-1]) / 3600.0
    return count, hours


def swept(band: str, seconds: int, *, rate: int, ratio: float, longer: float, seed: int) -> tuple[Record, float]:
    """A program's sweep in noise that is smaller by a ratio of rms, and when it begins [s]."""
    random = np.random.default_rng([rate, seconds, round(10 * ratio), round(10 * longer), seed])
    count = round(longer * seconds * rate)
    time, start = np.arange(count) / rate, random.uniform(0.0, (longer - 1.0) * seconds)
    sweep = parse(f"sweep:roll,{band}Hz,{seconds}s,1").signals(time - start)["roll"]
    return (time, np.asarray(sweep + 0.7 / ratio * coloured(random, count, rate=rate))), start


def found_and_false(rates: Sequence[int], ratio: float, seeds: Sequence[int]) -> tuple[int, int, int]:
    """Sweeps flown, those of which the better half is found with its end, and others that are seen."""
    flown = found = false = 0
    for rate in rates:
        for band, seconds in PROGRAMS:
            if float(band.split("-")[1]) > 0.4 * rate:
                continue
            for longer in (1.1, 4.0):
                for seed in seeds:
                    record, start = swept(band, seconds, rate=rate, ratio=ratio, longer=longer, seed=seed)
                    stop, seen = start + seconds, all_rising(*record)
                    flown += 1
                    found += any(min(r.stop, stop) - max(r.start, start) > 0.5 * seconds for r in seen)
                    false += sum(r.stop < start or r.start > stop for r in seen)
    return flown, found, false


def test_noise_is_no_sweep_and_would_be_without_the_test(monkeypatch: pytest.MonkeyPatch) -> None:
    def every() -> Iterator[Record]:
        yield from ringing(range(30))
        yield from quiet(25, 180, range(5))
        yield from quiet(100, 60, range(5))

    count, hours = false_alarms(every())
    assert hours > 1.8
    assert count == 0
    monkeypatch.setattr(sweeps_module, "_CONTRAST", 0.0)
    assert false_alarms(every())[0] > 0


def test_sweeps_in_noise_are_found_at_every_rate() -> None:
    flown, found, false = found_and_false((10, 50), 1.5, [0])
    assert flown == 12
    assert (found, false) == (flown, 0)


def test_hand_flown_sweeps_in_strong_gusts_are_found(shared_data: Path) -> None:
    truth = r50.truth(shared_data)
    asked = [gusty_sweeps.Question(axis, "by hand", gusty_sweeps.GUSTS["strong"], 1) for axis in truth.inputs[:2]]
    for question, flight in zip(asked, gusty_sweeps.fly(truth, asked), strict=True):
        found = all_rising(flight.time(question.axis), flight.values(question.axis))
        assert max(ridge.stop - ridge.start for ridge in found) > 60.0


def loiter(shared_data: Path) -> ModuleType:
    """The simulated copter that holds its place in gusts, of which nobody swept anything."""
    place = shared_data / "field" / "01-no-sweep"
    told = importlib.util.spec_from_file_location("sim_loiter", place / "sim_loiter.py")
    assert told is not None
    assert told.loader is not None
    made = importlib.util.module_from_spec(told)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(place))
        told.loader.exec_module(made)
    made.DF.save = lambda log, path: Path(path).write_bytes(bytes(log.b))  # its own leaves the file open
    return made


def test_a_copter_that_holds_its_place_in_gusts_flies_no_sweep(shared_data: Path, tmp_path: Path) -> None:
    from swashplate.flights.readers.read import read

    copter = loiter(shared_data)
    flown = copter.fly(0, T=120, dec=4)
    for every in (1, 4, 10):
        copter.log(str(tmp_path / "a.bin"), flown[::every])
        assert sweeps(read(tmp_path / "a.bin")) == ()


@pytest.mark.proof
def test_hundreds_of_hours_of_noise_and_hundreds_of_sweeps(shared_data: Path) -> None:
    rows: list[list[object]] = []
    total = hours = 0.0
    for rate in RATES:
        count = own = 0.0
        for seconds, many in ((30, 600), (180, 200), (600, 60)):
            more, length = false_alarms(quiet(rate, seconds, range(many)))
            count, own = count + more, own + length
        rows.append([f"noise at {rate} Hz", round(own, 1), int(count), ""])
        total, hours = total + count, hours + own
    count, own = false_alarms(ringing(range(1000)))
    rows.append(["a resonance at 10 Hz", round(own, 1), count, ""])
    total, hours = total + count, hours + own
    every = 0
    for ratio in (10.0, 3.0, 1.5):
        flown, found, false = found_and_false(RATES, ratio, range(5))
        rows.append([f"programs' sweeps, {ratio:g} times the noise", flown, false, 100.0 * found / flown])
        assert found >= 0.98 * flown
        every += false
    truth = r50.truth(shared_data)
    for gust in ("moderate", "strong", "severe"):
        asked = [
            gusty_sweeps.Question(axis, "by hand", gusty_sweeps.GUSTS[gust], seed)
            for axis in truth.inputs[:2]
            for seed in range(20)
        ]
        longest = [
            max((r.stop - r.start for r in all_rising(f.time(q.axis), f.values(q.axis))), default=0.0)
            for q, f in zip(asked, gusty_sweeps.fly(truth, asked), strict=True)
        ]
        share = 100.0 * float(np.mean(np.array(longest) > 60.0))
        rows.append([f"sweeps by hand, {gust} gusts", len(asked), "", share])
        assert share >= 95.0
    passed = total <= 0.01 * hours and every == 0
    proof_page.leave(
        "sweep-detection",
        {
            "title": "Sweeps that are seen in a signal",
            "text": "Stationary noise of random spectra (one resonance or two, a low-pass, white) holds no sweep; "
            "sweeps of programs lie in such noise, those by hand in a simulated R-50 that holds its place in gusts. "
            "Counted are hours or sweeps, what is seen where nothing was swept, and the share that is found.",
            "columns": ["signal", "hours or sweeps", "false", "found [%]"],
            "rows": rows,
            "passed": passed,
        },
    )
    assert passed, rows
