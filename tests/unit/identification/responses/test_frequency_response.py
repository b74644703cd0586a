"""Frequency responses: the sums, the conditioning, the errors, and what is said where they cannot be had."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from swashplate.errors import FlightError
from swashplate.flights.flight import Flight, stream
from swashplate.flights.provenance import Event, Provenance
from swashplate.identification.responses.composite import composite
from swashplate.identification.responses.frequency_response import FrequencyResponse
from swashplate.identification.responses.multi_input import SINGULAR, condition_spectra, own_shares
from swashplate.identification.responses.respond import choose_windows, respond
from swashplate.identification.responses.spectra import Signals, spectral_matrix

RATE = 100.0


def made(channels: dict[str, np.ndarray], *, rate: float = RATE, name: str = "made") -> Flight:
    n = len(next(iter(channels.values())))
    units = {key: "1" for key in channels if key.startswith(("stick", "sweep"))}
    return Flight({"uniform": stream(np.arange(n) / rate, channels, units)}, Provenance(source=name))


def coloured(seed: int, n: int) -> np.ndarray:
    return signal.lfilter([0.2], [1.0, -0.8], np.random.default_rng(seed).standard_normal(n))


def plant(u: np.ndarray, gain: float, frequency: float, damping: float, delay: int = 0) -> np.ndarray:
    """A second-order system on the sample grid, exact for held inputs."""
    a = (2 * np.pi * frequency) ** 2
    system = signal.cont2discrete(([gain * a], [1.0, 4 * np.pi * frequency * damping, a]), 1 / RATE)
    y = signal.lfilter(system[0].ravel(), system[1], u)
    return np.concatenate([np.zeros(delay), y[: len(y) - delay]])


def true_response(omega: np.ndarray, gain: float, frequency: float, damping: float) -> np.ndarray:
    a = (2 * np.pi * frequency) ** 2
    num, den, _ = signal.cont2discrete(([gain * a], [1.0, 4 * np.pi * frequency * damping, a]), 1 / RATE)
    return signal.freqz(num.ravel(), den, worN=omega / RATE)[1]


def test_spectra_are_those_of_the_chirp_z_transform() -> None:
    n = 400
    values = np.random.default_rng(1).standard_normal((n, 2))
    hertz = np.linspace(1.0, 9.0, 17)
    matrix = spectral_matrix([Signals("a", 0.01, values)], 2 * np.pi * hertz, window=4.0, overlap=0.5)
    assert matrix is not None
    taper = signal.windows.hann(n, sym=False)
    step = hertz[1] - hertz[0]
    total = np.zeros((17, 2, 2), dtype=complex)
    padded = np.pad(values, ((n // 2, n), (0, 0)))
    for start in range(0, n + 1, n // 2):
        cut = padded[start : start + n]
        cut = taper[:, None] * (cut - (taper @ cut) / taper.sum())
        z = signal.czt(cut, 17, w=np.exp(-2j * np.pi * step * 0.01), a=np.exp(2j * np.pi * hertz[0] * 0.01), axis=0)
        total += z.conj()[:, :, None] * z[:, None, :]
    expected = total * 2 * 0.01 / (2.0 * (taper @ taper))
    np.testing.assert_allclose(matrix.values, expected, rtol=1e-10, atol=1e-14)


def test_power_is_that_of_the_signal() -> None:
    u = np.random.default_rng(2).standard_normal(40_000)
    matrix = spectral_matrix(
        [Signals("a", 0.01, u[:, None])], 2 * np.pi * np.arange(5.0, 45.0), window=4.0, overlap=0.75
    )
    assert matrix is not None
    # White noise of variance one over 50 Hz: 0.02 units^2/Hz, averaged over 40 lines of 100 windows.
    assert np.mean(matrix.values.real) == pytest.approx(0.02, rel=0.03)


def test_conditioning_tells_correlated_inputs_apart_and_single_responses_do_not() -> None:
    n = 60_000
    first, second = coloured(3, n), coloured(4, n)
    mixed = 1.2 * first + second
    noise = 0.02 * np.random.default_rng(5).standard_normal((2, n))
    y = plant(first, 2.0, 2.0, 0.4) + plant(mixed, 0.3, 3.0, 0.5) + noise[0]
    flight = made({"stick1": first, "stick2": mixed, "out": y})
    both = respond(flight, inputs=["stick1", "stick2"], outputs=["out"], band=(0.2, 8.0))
    alone = respond(flight, inputs=["stick2"], outputs=["out"], band=(0.2, 8.0))
    truth = true_response(both.omega, 0.3, 3.0, 0.5)
    h, coherence, error = both.pair("out", "stick2")
    used = coherence >= 0.6
    assert used.sum() > 40
    decibels = np.abs(20 * np.log10(np.abs(h / truth)))[used]
    assert np.all(decibels < np.maximum(1.0, 20 * np.log10(1 + 3 * error[used])))
    assert np.median(np.abs(20 * np.log10(np.abs(alone.pair("out", "stick2")[0] / truth)))) > 3.0
    assert any("'stick1' moved along" in text for text in alone.warnings)
    assert any("moved together" in text for text in both.warnings)


@pytest.mark.proof
def test_random_error_is_what_many_seeds_scatter() -> None:
    logs, promised = [], []
    truth = None
    for seed in range(40):
        u = coloured(seed, 6_000)
        y = plant(u, 1.0, 2.0, 0.5) + 0.4 * np.random.default_rng(1000 + seed).standard_normal(6_000)
        found = respond(made({"stick": u, "out": y}), inputs=["stick"], outputs=["out"], band=(0.5, 4.0), windows=[5.0])
        truth = true_response(found.omega, 1.0, 2.0, 0.5) if truth is None else truth
        h, _, error = found.pair("out", "stick")
        logs.append(np.log(h / truth))
        promised.append(error)
    scattered = np.sqrt(np.mean(np.square(np.real(logs)), axis=0))
    ratio = np.mean(scattered / np.mean(promised, axis=0))
    assert 0.8 < ratio < 1.15
    phase = np.sqrt(np.mean(np.square(np.imag(logs)), axis=0))
    assert 0.8 < np.mean(phase / np.mean(promised, axis=0)) < 1.15


def test_composite_of_agreeing_windows_is_their_value_and_the_better_window_decides() -> None:
    one = np.full((2, 3), 2.0)
    xx, yy, xy = composite(one, 3 * one, (1 + 1j) * one, np.full((2, 3), 0.1))
    np.testing.assert_allclose(xx, 2.0)
    np.testing.assert_allclose(yy, 6.0)
    np.testing.assert_allclose(xy, 2.0 + 2.0j)
    better = np.array([[0.01], [0.1]])
    xx, yy, xy = composite(np.array([[1.0], [1.3]]), np.array([[1.0], [1.2]]), np.array([[0.9j], [0.5j]]), better)
    assert xx[0] == pytest.approx(1.0, abs=1e-3)
    assert xy[0] == pytest.approx(0.9j, abs=1e-3)


def test_joint_estimate_is_unbiased_in_a_loop_where_the_direct_one_is_not() -> None:
    n, random = 30_000, np.random.default_rng(7)
    reference, gust = coloured(8, n), 0.5 * coloured(9, n)
    b, a, _ = signal.cont2discrete(([4.0], [1.0, 2.0]), 1 / RATE)
    b = b.ravel()
    u, y, x = np.zeros(n), np.zeros(n), 0.0
    for k in range(1, n):
        x = -a[1] * x + b[1] * u[k - 1]
        y[k] = x + gust[k]
        u[k] = reference[k] - 1.0 * y[k]
    sensor = 0.01 * random.standard_normal(n)
    flight = made({"stick": u, "out": y + sensor, "sweep": reference})
    joint = respond(flight, inputs=["stick"], outputs=["out"], references=["sweep"], band=(0.1, 2.0))
    direct = respond(flight, inputs=["stick"], outputs=["out"], band=(0.1, 2.0))
    truth = signal.freqz(b, a, worN=joint.omega / RATE)[1]

    def off(found: FrequencyResponse) -> float:
        return float(np.median(np.abs(20 * np.log10(np.abs(found.pair("out", "stick")[0] / truth)))))

    assert off(joint) < 0.7 < 1.8 < off(direct)
    assert any("feedback biases the direct estimate" in text for text in joint.warnings)


def test_one_log_that_sweeps_axis_after_axis_has_a_reference_for_each() -> None:
    """Two axes under loops that mix them, gusts in both, swept in turn within one record."""
    n = 18_000
    reference = np.column_stack([coloured(20, n), coloured(21, n)])
    time = np.arange(n) / RATE
    half = n / 2 / RATE
    reference[time < half, 1] = reference[time >= half, 0] = 0.0
    gust = 0.03 * np.column_stack([coloured(22, n), coloured(23, n)])
    truth = np.array([[2.0, 0.5], [-0.4, 3.0]])
    u, y, x = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros(2)
    for k in range(1, n):
        x = x + (truth @ u[k - 1] - 2.0 * x) / RATE
        y[k] = x + gust[k]
        u[k] = reference[k] - np.array([[0.5, 0.2], [0.1, 0.5]]) @ y[k]
    target = reference.sum(axis=1)
    channels = {"roll": u[:, 0], "pitch": u[:, 1], "p": y[:, 0], "q": y[:, 1], "sid_target": target}
    log = made(channels)

    def sweeps(*axes: int) -> Flight:
        events = tuple(
            Event(i * half, "sweep", "", {"axis": a, "start": i * half, "stop": (i + 1) * half})
            for i, a in enumerate(axes)
        )
        return replace(log, provenance=replace(log.provenance, events=events))

    ask: dict[str, Any] = {"inputs": ["roll", "pitch"], "outputs": ["p", "q"], "band": (0.2, 3.0)}
    found = respond(sweeps(10, 11), references=["sid_target"], **ask)
    z = np.exp(1j * found.omega / RATE)[:, None, None]
    off = np.abs(found.response / (truth / RATE / (z - 1.0 + 2.0 / RATE)) - 1.0)
    assert np.median(off) < 0.06
    assert (off < 4.0 * found.error + 0.03).mean() > 0.97
    assert any("--references sid_target" in text for text in respond(sweeps(10, 11), **ask).warnings)
    with pytest.raises(FlightError, match="no sweep of 'pitch'"):
        respond(sweeps(10, 10), references=["sid_target"], **ask)
    assert not any("--references" in text for text in respond(sweeps(10, 10), **ask).warnings)


@pytest.mark.parametrize("own", [0.0, 0.03, 0.3])
def test_what_is_an_inputs_own_is_found_behind_what_windows_blur(own: float) -> None:
    """One input follows the other through a mode damped as a rotor's; beside it a known share is its own."""
    n, hertz = 12_000, np.geomspace(0.5, 6.0, 40)
    first = signal.chirp(np.arange(n) / RATE, 0.1, n / RATE, 8.0, method="log")
    answer = plant(first, 1.0, 2.0, 0.12)
    extra = signal.chirp(np.arange(n)[::-1] / RATE, 0.1, n / RATE, 8.0, method="log")  # the same power, elsewhere
    followed = np.abs(true_response(2 * np.pi * hertz, 1.0, 2.0, 0.12)) ** 2
    pieces = [Signals("a", 1 / RATE, np.column_stack([first, answer + own * extra]))]
    found = [spectral_matrix(pieces, 2 * np.pi * hertz, window=w, overlap=0.75) for w in (20.0, 5.0)]
    matrices = [m for m in found if m is not None]
    plain = condition_spectra(matrices[1].values, 2, averages=matrices[1].averages).own_share[:, 1]
    assert plain.max() > 0.04  # at the mode, whatever the share
    expected = own**2 / (own**2 + followed)
    apart = (hertz < 0.7) | (hertz > 1.1)  # between, both sweeps pass at the same time
    for share in own_shares(pieces, matrices, 2 * np.pi * hertz, inputs=2, overlap=0.75):
        assert share is not None
        assert share[apart, 1] == pytest.approx(expected[apart], rel=0.2, abs=0.3 * SINGULAR)


def test_inputs_that_are_nearly_one_in_a_part_of_the_band_are_named_there() -> None:
    n = 24_000
    low = signal.sosfilt(signal.butter(4, 0.5, output="sos", fs=RATE), np.random.default_rng(30).standard_normal(n))
    one, other = 0.25 * low + 0.05 * coloured(31, n), 0.25 * low + 0.05 * coloured(32, n)
    found = respond(
        made({"stick1": one, "stick2": other, "out": plant(one, 1.0, 2.0, 0.5)}),
        inputs=["stick1", "stick2"],
        outputs=["out"],
        band=(0.1, 8.0),
    )
    (text,) = (w for w in found.warnings if "nearly one" in w)
    assert "0.1-" in text
    assert not any("moved together" in w for w in found.warnings)


def test_doubled_and_dead_inputs_are_named_and_the_rest_is_kept() -> None:
    n = 20_000
    u, other = coloured(10, n), coloured(11, n)
    y = plant(u, 1.0, 2.0, 0.5) + plant(other, 1.0, 1.0, 0.5)
    flight = made({"stick1": u, "stick2": 0.5 * u, "stick3": other, "stick4": np.zeros(n), "out": y})
    found = respond(flight, inputs=["stick1", "stick2", "stick3", "stick4"], outputs=["out"], band=(0.2, 5.0))
    assert sum("'stick1' and 'stick2' move together" in text for text in found.warnings) == 1
    (text,) = found.problems
    assert "'stick4' never moves" in text
    assert np.isnan(found.pair("out", "stick1")[0]).all()
    h = found.pair("out", "stick3")[0]
    np.testing.assert_allclose(np.abs(h / true_response(found.omega, 1.0, 1.0, 0.5)), 1.0, atol=0.1)


def test_what_cannot_be_done_is_said() -> None:
    n = 2_000
    u, noise = coloured(12, n), coloured(13, n)
    flight = made({"stick": u, "out": noise})
    found = respond(flight, inputs=["stick"], outputs=["out"], band=(0.5, 10.0))
    assert any("do not use its responses" in text for text in found.problems)
    with pytest.raises(FlightError, match=r"longest record has 20 s, the shortest window 50 s"):
        respond(flight, inputs=["stick"], outputs=["out"], windows=[50.0], band=(0.5, 10.0))
    with pytest.raises(FlightError, match="lacks what the frequency response needs"):
        respond(flight, inputs=["stick"], outputs=["nothing"])
    with pytest.raises(FlightError, match="different rates"):
        respond([flight, made({"stick": u, "out": noise}, rate=50.0)], inputs=["stick"], outputs=["out"])


def test_window_rules() -> None:
    chosen = choose_windows([100.0, 60.0], 10.0)
    assert chosen.lengths[0] == pytest.approx(30.0)
    assert chosen.lengths[-1] == pytest.approx(3.0)
    assert not chosen.warnings
    assert choose_windows([10.0], 5.0).warnings


def test_file_and_control_round_trip(tmp_path: Path) -> None:
    n = 6_000
    u = coloured(14, n)
    found = respond(
        made({"stick": u, "out": plant(u, 1.0, 2.0, 0.5)}), inputs=["stick"], outputs=["out"], band=(0.5, 5.0)
    )
    back = FrequencyResponse.load(found.save(tmp_path / "r.nc"))
    np.testing.assert_array_equal(back.response, found.response)
    assert (back.inputs, back.outputs, back.windows, back.sources) == (
        found.inputs,
        found.outputs,
        found.windows,
        found.sources,
    )
    frd = found.to_control()
    assert frd.name == "responses"
    again = FrequencyResponse.from_control(frd)
    np.testing.assert_array_equal(again.response, found.response)
    assert again.outputs == ("out",)
    assert "out / stick" in repr(found)
    assert "coherence" in found.table("out", "stick")
    (tmp_path / "bad.nc").write_bytes(b"no")
    with pytest.raises(FlightError, match="does not hold frequency responses"):
        FrequencyResponse.load(tmp_path / "bad.nc")


def test_a_slowly_logged_output_ends_the_band_and_is_right_below() -> None:
    n = 12000
    u = coloured(5, n)
    y = plant(u, 2.0, 1.5, 0.4)
    t = np.arange(n) / RATE
    units = {"stick": "1"}
    log = Flight({"fast": stream(t, {"stick": u}, units), "slow": stream(t[3::4], {"r": y[3::4]})})
    found = respond(
        log.condition(rate=RATE, cutoff=0, method="spline"), inputs=["stick"], outputs=["r"], band=(0.2, 15)
    )
    assert any("'r' was logged 25 times a second: the band ends at 8.33 Hz, not at 15 Hz" in w for w in found.warnings)
    assert found.omega[-1] == pytest.approx(2 * np.pi * 25 / 3)
    h, _, _ = found.pair("r", "stick")
    low = found.omega < 2 * np.pi * 6.0
    assert np.max(np.abs(20 * np.log10(np.abs(h / true_response(found.omega, 2.0, 1.5, 0.4))))[low]) < 0.3


def test_an_unasked_band_begins_at_two_periods_of_the_longest_window() -> None:
    u = coloured(6, 6000)
    flight = made({"stick": u, "r": plant(u, 1.0, 1.0, 0.5)})
    free = respond(flight, inputs=["stick"], outputs=["r"])
    assert free.omega[0] == pytest.approx(2 * np.pi * 2.0 / max(free.windows))
    asked = respond(flight, inputs=["stick"], outputs=["r"], band=(0.01, 5.0))
    assert asked.omega[0] == pytest.approx(2 * np.pi * 1.0 / max(asked.windows))


def test_commands_without_units_are_bystanders_and_a_loops_own_answer_is_none() -> None:
    sweep = coloured(7, 12000)
    answer = coloured(8, 12000)
    both = {
        "lateral": sweep,
        "pedal": 0.6 * sweep + answer,
        "r": plant(sweep, 1.0, 1.0, 0.5) + plant(answer, 3.0, 1.0, 0.5),
    }
    bare = Flight({"uniform": stream(np.arange(12000) / RATE, both)})
    found = respond(bare, inputs=["lateral"], outputs=["r"], band=(0.2, 8.0))
    assert any("'pedal' moved along" in text for text in found.warnings)
    injected = Flight({"uniform": stream(np.arange(12000) / RATE, {**both, "sid_target": sweep})})
    closed = respond(injected, inputs=["sid_target"], outputs=["r"], band=(0.2, 8.0))
    assert not any("moved along" in text for text in closed.warnings)
