"""Conditioning keeps its promises whatever the stamps and gaps."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from swashplate.errors import FlightError
from swashplate.flights.conditioning.attitude import continuous, euler_from_quaternion, quaternion_from_euler
from swashplate.flights.conditioning.condition import condition
from swashplate.flights.conditioning.outliers import outliers
from swashplate.flights.conditioning.resample import resample
from swashplate.flights.flight import Flight, stream

seeds = st.integers(0, 2**32 - 1)


def ragged(seed: int, rate: float, holes: int) -> Flight:
    rng = np.random.default_rng(seed)
    t = (np.arange(int(8 * rate)) + rng.uniform(-0.3, 0.3, int(8 * rate))) / rate
    keep = np.ones(t.size, dtype=bool)
    for _ in range(holes):
        at = rng.uniform(0, 8)
        keep &= np.abs(t - at) > rng.uniform(0.01, 0.4)
    t = t[keep]
    return Flight({"a": stream(t, {"x": 2.0 + 0.5 * t, "theta": 0.1 * np.sin(t), "phi": 0 * t, "psi": 0.2 * t})})


@settings(max_examples=40, deadline=None)
@given(seed=seeds, rate=st.floats(60, 260), new=st.floats(20, 150), holes=st.integers(0, 5))
def test_the_result_is_uniform_inside_its_segments_and_never_extrapolates(
    seed: int, rate: float, new: float, holes: int
) -> None:
    flight = ragged(seed, rate, holes)
    try:
        out = resample(flight, rate=new, max_gap=0.06)
    except FlightError:
        return
    assert out.start >= flight.start - 1e-9
    assert out.stop <= flight.stop + 1e-9
    kept = 0
    for part in out.split():
        assert np.allclose(np.diff(part.time("x")), 1.0 / new)
        kept += part.time("x").size
    assert kept == out.time("x").size
    np.testing.assert_allclose(out.values("x"), 2.0 + 0.5 * out.time("x"), atol=2e-2)
    for first, last in out.segments:
        inside = flight.time("x")
        inside = inside[(inside >= first - 0.06) & (inside <= last + 0.06)]
        assert np.max(np.diff(inside)) <= 0.06 + 1e-12


@settings(max_examples=30, deadline=None)
@given(seed=seeds, scale=st.floats(1e-6, 1e6), shift=st.floats(-1e3, 1e3))
def test_outliers_do_not_depend_on_unit_or_zero(seed: int, scale: float, shift: float) -> None:
    rng = np.random.default_rng(seed)
    t = np.arange(400) / 150.0
    y = np.sin(3 * t) + 0.01 * rng.standard_normal(t.size)
    spikes = rng.choice(np.arange(20, 380), 3, replace=False)
    y[spikes] += 0.5
    found = outliers(t, y)
    assert found[spikes].all()
    assert found.sum() <= 5
    np.testing.assert_array_equal(found, outliers(t, scale * (y + shift)))


@settings(max_examples=40, deadline=None)
@given(
    angles=st.lists(
        st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1)), min_size=1, max_size=20
    ),
    seed=seeds,
)
def test_attitudes_survive_sign_flips(angles: list[tuple[float, float, float]], seed: int) -> None:
    q = quaternion_from_euler(np.array(angles))
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (len(angles), 1))
    again = quaternion_from_euler(euler_from_quaternion(continuous(q * signs)))
    np.testing.assert_allclose(np.abs(np.sum(again * q, axis=1)), 1.0, atol=1e-9)


@settings(max_examples=8, deadline=None)
@given(seed=seeds, bad=st.sampled_from([np.nan, np.inf, 1e9]), count=st.integers(0, 20))
def test_conditioning_gives_finite_numbers_or_says_why(seed: int, bad: float, count: int) -> None:
    flight = ragged(seed, 150.0, 2)
    rng = np.random.default_rng(seed)
    data = flight.streams["a"].copy(deep=True)
    data["x"].values[rng.choice(data.sizes["time"], count, replace=False)] = bad
    try:
        out = condition(flight.with_streams({"a": data}))
    except FlightError:
        return
    assert all(np.isfinite(out.values(name)).all() for name in out.channels)
