"""Reduced models, the paper's layout, and LPV flight against the nonlinear equations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from swashplate.control.laws.state_hold import state_hold
from swashplate.errors import FlightError, SwashError
from swashplate.flights.flight import Flight
from swashplate.models.catalogue import vehicle
from swashplate.simulation.closed_loop import simulate_closed_loop
from swashplate.simulation.linearize import LinearModel, linearize
from swashplate.simulation.lpv import Schedule, schedule, simulate_lpv
from swashplate.simulation.reduction import (
    HYBRID,
    LATERAL,
    LONGITUDINAL,
    METTLER,
    PAPER_INPUTS,
    PAPER_STATES,
    omissions,
    paper_model,
    part,
    residualise,
)
from swashplate.simulation.trim import trim

RAPTOR = vehicle("raptor50").with_values({"wake_distortion": 0.0})
RATE = 500.0


@pytest.fixture(scope="module")
def hover() -> LinearModel:
    return linearize(RAPTOR, trim(RAPTOR))


@pytest.fixture(scope="module")
def table() -> Schedule:
    return schedule(RAPTOR, np.linspace(0.0, 10.0, 11))


@pytest.fixture(scope="module")
def dash() -> Flight:
    """From hover to 8 m/s under a hold: the nonlinear truth, and the controls that the LPV models are given."""
    fast = trim(RAPTOR, speed=8.0)
    return simulate_closed_loop(
        RAPTOR, state_hold(RAPTOR, fast, rate=100.0), duration=6.0, start=trim(RAPTOR), rate=RATE
    )


def test_eight_states_keep_the_slow_modes(hover: LinearModel) -> None:
    """0.65 +- 1.09j and -0.41 +- 1.36j of the independent calculation; flapping moves them by less than 1 %."""
    slow = np.linalg.eigvals(paper_model(hover).A)
    full = np.linalg.eigvals(hover.A)
    for published in (0.65 + 1.09j, -0.41 + 1.36j):
        nearest = slow[np.argmin(np.abs(slow - published))]
        assert abs(nearest - published) < 0.02
        assert np.min(np.abs(full - nearest)) < 0.01


def test_three_degrees_of_freedom_miss_the_coupling(hover: LinearModel) -> None:
    """The phugoid alone grows at 0.12 1/s; coupled to roll, at 0.65 (PHYSICS 4.3: 0.11 +- 0.94j)."""
    alone = part(paper_model(hover), *LONGITUDINAL)
    phugoid = max(np.linalg.eigvals(alone.A), key=lambda value: value.imag)
    assert phugoid == pytest.approx(0.11 + 0.94j, abs=0.02)
    assert part(paper_model(hover), *LATERAL).A.shape == (4, 4)


def test_layout_as_printed(hover: LinearModel) -> None:
    exact, printed = paper_model(hover), paper_model(hover, as_printed=True)
    assert (exact.states, exact.inputs) == (PAPER_STATES, PAPER_INPUTS)
    at = {name: i for i, name in enumerate(PAPER_STATES)}
    assert printed.A[at["u"], at["theta"]] == pytest.approx(-9.81, abs=0.02)
    assert printed.A[at["w"], at["u"]] == 0.0 != exact.A[at["w"], at["u"]]
    assert printed.A[at["theta"], at["r"]] == 0.0 != exact.A[at["theta"], at["r"]]
    assert printed.B[at["r"], 1] == 0.0 != exact.B[at["r"], 1]
    np.testing.assert_allclose(printed.A[at["q"], at["q"]], exact.A[at["q"], at["q"]])


def test_ten_and_thirteen_states() -> None:
    flown = vehicle("raptor50", bar=True, gyro=True)
    model = linearize(flown, trim(flown))
    assert len(METTLER) == 13
    thirteen = residualise(model, METTLER)
    np.testing.assert_allclose(  # nothing but position and heading was left out: the same modes
        np.sort_complex(np.linalg.eigvals(thirteen.A)),
        np.sort_complex([v for v in np.linalg.eigvals(model.A) if abs(v) > 1e-5]),
        atol=1e-6,
    )
    bar = max((m for m in thirteen.modes() if m.states[0][0] in ("p", "d")), key=lambda m: m.frequency)
    assert bar.frequency == pytest.approx(17.9, rel=0.05)  # PHYSICS 4.3: -1.63 +- 17.9j
    assert residualise(model, HYBRID).A.shape == (10, 10)
    with pytest.raises(SwashError, match="r_gyro: is not a state of this model"):
        residualise(linearize(RAPTOR, trim(RAPTOR)), METTLER)


def test_what_may_be_left_out(hover: LinearModel) -> None:
    """The paper leaves X_r out; L_p and M_q must stay."""
    study = {entry.derivative: entry for entry in omissions(paper_model(hover))}
    assert len(study) == 60
    assert max(study["Xr"].modes, study["Xr"].response) < 1e-3
    assert min(study["Lp"].modes, study["Mq"].modes) > 0.3
    assert study["Ztheta0"].response == pytest.approx(1.0, abs=0.01)


def _error(dash: Flight, table: Schedule, scheme: str, second: float) -> float:
    controls = {name: dash.values(name) for name in PAPER_INPUTS}
    flown = simulate_lpv(RAPTOR, controls, start=trim(RAPTOR), scheme=scheme, over=table, rate=RATE)  # type: ignore[arg-type]
    place = round(second * RATE)
    return float(np.hypot(*(flown.values(n)[place] - dash.values(n)[place] for n in ("u", "v"))))


@pytest.mark.proof
def test_the_printed_scheme_loses_the_flight_and_the_others_do_not(dash: Flight, table: Schedule) -> None:
    """After 6 s: printed is off by more than the flight itself, the stitched model by a tenth of it."""
    assert dash.values("u")[-1] == pytest.approx(8.0, abs=0.2)
    printed, trimmed, stitched = (_error(dash, table, s, 5.9) for s in ("as-printed", "trim-term", "stitched"))
    assert printed > 8.0
    assert stitched < 1.5
    assert trimmed < 4.0
    assert stitched < 0.2 * printed


def test_near_a_trim_of_the_table_it_flies_as_the_linear_model_there(table: Schedule) -> None:
    """In short, of one scheme: kept where it is trimmed, and a small step of collective by the matrix exponential."""
    start, last = trim(RAPTOR, speed=8.0), 10
    flown = []
    for step in (0.0, 1e-4):
        controls = {name: np.full(61, start.commands()[name] + step * (name == "theta0")) for name in PAPER_INPUTS}
        flown.append(simulate_lpv(RAPTOR, controls, start=start, scheme="trim-term", over=table, rate=100.0))
    at = [PAPER_STATES.index(name) for name in ("u", "v", "w", "p", "q", "r")]
    moved, kept = (np.array([f.values(PAPER_STATES[k]) for k in at]) for f in (flown[1], flown[0]))
    np.testing.assert_allclose(kept[:, -1], kept[:, 0], atol=1e-9)
    n, push = len(PAPER_STATES), 1e-4 * table.B[8][:, PAPER_INPUTS.index("theta0")]
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = table.A[8], push
    expected = expm(last / 100.0 * whole)[:n, n][at]
    np.testing.assert_allclose(moved[:, last] - kept[:, last], expected, atol=0.02 * np.abs(expected).max())


def test_why_the_printed_scheme_drifts(table: Schedule) -> None:
    """At a steady 8 m/s nothing should accelerate; A (x - x0) + B (u - u0) does, by metres per second squared."""
    moving = table.A[8] @ (table.x[8] - table.x[0]) + table.B[8] @ (table.u[8] - table.u[0])
    assert np.max(np.abs(moving[:2])) > 1.0


def test_lpv_refuses_what_it_cannot_fly(table: Schedule) -> None:
    start = trim(RAPTOR)
    controls = {name: np.zeros(5) for name in PAPER_INPUTS}
    with pytest.raises(FlightError, match="B1: is missing"):
        simulate_lpv(RAPTOR, {"theta0": np.zeros(5)}, start=start, scheme="stitched", over=table)
    with pytest.raises(SwashError, match="needs a schedule"):
        simulate_lpv(RAPTOR, controls, start=start, scheme="stitched")
    with pytest.raises(SwashError, match="expected 'as-printed'"):
        simulate_lpv(RAPTOR, controls, start=start, scheme="magic")  # type: ignore[arg-type]
    with pytest.raises(SwashError, match="other states than body and flapping"):
        simulate_lpv(vehicle("raptor50", bar=True), controls, start=start, scheme="stitched", over=table)
