"""The report before it is a page: numbers in words, downsampling, banners, sections."""

from __future__ import annotations

import base64
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from report_samples import fit, flight, modes, validation
from swashplate.errors import SwashError
from swashplate.flights.provenance import Problem, ProcessingStep
from swashplate.identification.core import result_file
from swashplate.identification.core.sources import source_of, sources_of
from swashplate.reporting.compose import compose, hover_modes
from swashplate.reporting.figures_fit import autocorrelation, cost_history
from swashplate.reporting.figures_time import Series, time_figures
from swashplate.reporting.sections_fit import parameters
from swashplate.reporting.sections_validation import apart
from swashplate.reporting.structure import Cell, Report, Section, Table
from swashplate.reporting.terminal_tables import fit_table
from swashplate.reporting.terms import TERMS
from swashplate.reporting.theme import joined, kept, packed, phase_ticks
from swashplate.reporting.versions import card_hash, date, result_hash
from swashplate.reporting.words import (
    mode_words,
    noise_told,
    plain_words,
    sigma_words,
    span_words,
    step_words,
    value_words,
)
from swashplate.validation.prediction import HORIZONS
from swashplate.validation.validation import PREDICTORS, AxisVerdict
from swashplate.validation.verdict import JUDGED_AT


@given(
    st.lists(st.floats(-1e6, 1e6) | st.just(float("nan")), min_size=1, max_size=3000),
    st.integers(min_value=50, max_value=400),
)
@settings(max_examples=40, deadline=None)
def test_downsampling_keeps_ends_and_extremes(rows: list[float], limit: int) -> None:
    values = np.array(rows)
    values[min(1, values.size - 1) :: 97] = np.nan if values.size > 500 else values[min(1, values.size - 1) :: 97]
    places = kept(values, limit=limit)
    gaps = int(np.sum(~np.isfinite(values)))
    assert np.all(np.diff(places) > 0)
    assert {0, values.size - 1} <= set(places.tolist())
    assert places.size <= max(limit, gaps + 4)
    if np.any(np.isfinite(values)):
        assert np.nanmax(values[places]) == np.nanmax(values)
        assert np.nanmin(values[places]) == np.nanmin(values)


def test_pieces_are_not_bridged() -> None:
    time, values = joined([(np.array([0.0, 1.0]), np.array([5.0, 6.0])), (np.array([3.0]), np.array([7.0]))])
    assert time.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert np.isnan(values[2])


def test_band_closes_before_a_gap_and_opens_after_it() -> None:
    time = np.arange(6.0)
    model = np.array([1.0, 2.0, np.nan, 4.0, 5.0, 6.0])
    series = Series(time, np.zeros(6), model, np.array(0.5))
    inputs = [(time, np.zeros((6, 1)))]
    (figure,) = time_figures({"x": [series]}, inputs, ["servo_roll"], identifier="f", source="s", model_words="m")
    band = next(trace for trace in figure.spec["data"] if trace.get("fill") == "toself")
    assert band["x"] == [0.0, 1.0, 1.0, 0.0, None, 3.0, 4.0, 5.0, 5.0, 4.0, 3.0, None]
    assert band["y"] == [2.0, 3.0, 1.0, 0.0, None, 5.0, 6.0, 7.0, 5.0, 4.0, 3.0, None]


def test_angles_are_drawn_in_degrees() -> None:
    time = np.arange(3.0)
    series = Series(time, np.full(3, np.pi))
    inputs = [(time, np.zeros((3, 1)))]
    (figure,) = time_figures({"psi": [series]}, inputs, ["motor_lower"], identifier="f", source="s", model_words="m")
    assert figure.spec["data"][-1]["y"] == [180.0, 180.0, 180.0]
    assert figure.spec["layout"]["yaxis2"]["title"]["text"] == "psi [deg]"


def test_long_rows_are_packed_without_loss_to_seven_digits() -> None:
    rows = np.linspace(-3.0, 40.0, 500)
    rows[7] = np.nan
    found = packed(rows)
    assert isinstance(found, dict)
    back = np.frombuffer(base64.b64decode(found["bdata"]), dtype="<f4")
    np.testing.assert_allclose(back, rows, rtol=1e-6)
    late = packed(rows + 1e6)
    assert isinstance(late, dict)
    assert late["dtype"] == "f8"


@pytest.mark.parametrize(
    ("value", "sigma", "words"),
    [
        (0.123456, 0.0123, "0.123"),
        (1.6, 0.0001, "1.6"),
        (2.2607e-05, None, "2.261e-5"),
        (1234.5678, 12.0, "1235"),
        (float("nan"), 1.0, "–"),
        (None, None, "–"),
        (0.0, 0.1, "0"),
    ],
)
def test_values_show_the_digits_that_sigma_leaves(value: float | None, sigma: float | None, words: str) -> None:
    assert value_words(value, sigma) == words


def test_a_mode_oscillates_only_where_it_does() -> None:
    assert mode_words(complex(-0.0485, 5e-9)) == "-0.0485 1/s"
    assert mode_words(complex(0.25, -9.99)) == "+0.25 ± 9.99j 1/s"


def test_sigma_has_two_digits() -> None:
    assert [sigma_words(s) for s in (0.01234, 123.4, float("inf"), None)] == ["0.012", "120", "–", "–"]


def test_steps_are_told_in_words() -> None:
    told = [step_words(step) for step in flight().history]
    assert told[0] == "Outliers beyond 6.0 robust standard deviations were removed: 5 samples (x 3 and phi 2)."
    assert "100 Hz (logged at 150.0 Hz), gaps of up to 60 ms" in told[1]
    assert "zero-phase Butterworth low-pass of order 4 at 15 Hz" in told[2]
    assert told[3] == "unheard_of: strength = 3"
    assert step_words(ProcessingStep("lowpass", {})) == "lowpass: no details"


def test_paths_show_their_last_part_only() -> None:
    assert plain_words(["/home/somebody/flights/a.mat", 0.1]) == "a.mat, 0.1"
    assert plain_words("roll/pitch") == "roll/pitch"


def test_span_counts_segments_only() -> None:
    split = replace(flight(10.0), segments=((0.0, 4.0), (5.0, 9.0)))
    assert span_words(source_of(split)) == "8.0 s in 2 segments at 100 Hz"


def test_autocorrelation_of_white_noise_stays_inside_its_bound() -> None:
    rows = np.random.default_rng(1).standard_normal(4000)
    found, bound = autocorrelation([rows[:1500], rows[1500:]], lags=50)
    assert found[0] == 1.0
    assert np.mean(np.abs(found[1:]) > bound) < 0.12
    coloured, _ = autocorrelation([np.convolve(rows, np.ones(20), mode="valid")], lags=50)
    assert coloured[10] == pytest.approx(0.5, abs=0.1)


def test_simulated_and_failed_come_first() -> None:
    shown = compose(fit(failed=True, simulated=True), modes=modes()).banners
    assert [words.split(":")[0] for _, words in shown] == ["SIMULATED FLIGHT", "FAILED FIT"]
    assert "inertia_zz" in shown[1][1]
    assert compose(fit(), modes=modes()).banners == ()
    half = compose(fit(), validation(simulated=True), modes=modes()).banners
    assert half == (("caution", "SIMULATED FLIGHT (hover.mat): no aircraft flew for these numbers."),)
    stopped = compose(replace(fit(), converged=False), modes=modes()).banners
    assert stopped[0][1].startswith("NOT CONVERGED")


def test_a_flight_that_the_fit_used_is_no_hold_out() -> None:
    one = fit()
    again = replace(validation(), data=sources_of((flight(),)))

    def what(report: Report) -> str:
        return next(words for label, words, _ in report.summary if label == "What")

    report = compose(one, again, modes=modes())
    assert report.banners == (("caution", "NOT A HOLD-OUT: sweep.mat was used for the fit too."),)
    assert "never saw" not in what(report)
    part = replace(again, data=sources_of((flight().between(0.0, 5.0),)))
    assert compose(one, part, modes=modes()).banners == report.banners
    assert "never saw" in what(compose(one, validation(), modes=modes()))


def test_summary_has_five_lines_and_a_picture() -> None:
    for report in (compose(fit(), validation(), modes=modes()), compose(fit(), modes=modes())):
        assert len(report.summary) == 5
        assert report.picture is not None
    only = compose(None, validation(), modes=modes())
    assert [label for label, _, _ in only.summary] == ["Verdict", "Warnings", "What", "Prediction"]
    assert only.verdict is not None
    assert [row[0].words for row in only.verdict.rows] == [one.axis for one in validation().verdict]


def test_the_warnings_tell_what_is_wrong_with_the_logs() -> None:
    def warnings(**changed: Any) -> str:
        return {label: words for label, words, _ in compose(None, replace(validation(), **changed)).summary}["Warnings"]

    gaps = Problem("motion: 8 gaps in the time stamps, the longest 51 ms (usual step 6.7 ms)")
    told = tuple(replace(one, problems=(gaps,)) for one in validation().data)
    assert "no problem was found" not in warnings(data=told)
    assert f"hover.mat: {gaps.text}" in warnings(data=told)
    assert gaps.text not in warnings()


def test_summary_praises_the_model_only_where_it_beats_every_rival() -> None:
    tones = {label: tone for label, _, tone in compose(None, validation(), modes=modes()).summary}
    assert tones["Prediction"] == "good"
    good = validation()
    worse = tuple(
        replace(s, fit=-5.0) if (s.channel, s.horizon, s.predictor) == ("q", 1.0, "model") else s for s in good.scores
    )
    tones = {label: tone for label, _, tone in compose(None, replace(good, scores=worse), modes=modes()).summary}
    assert tones["Prediction"] == "caution"


def test_the_verdicts_bar_is_green_only_where_every_axis_was_judged() -> None:
    seen = validation()

    def tone(*levels: str) -> str:
        verdict = tuple(AxisVerdict(f"axis {k}", level, "") for k, level in enumerate(levels))
        rows = compose(None, replace(seen, verdict=verdict), modes=modes()).summary
        return next(tone for label, _, tone in rows if label == "Verdict")

    assert tone("good", "good") == "good"
    assert tone("good", "good", "cannot be judged", "cannot be judged", "cannot be judged") == "caution"
    assert tone("cannot be judged") == tone() == "caution"
    assert tone("usable", "good") == "caution"
    assert tone("cannot be judged", "poor") == "bad"


def test_every_part_is_there() -> None:
    report = compose(fit(), validation(), modes=modes())
    assert [section.identifier for section in report.sections] == [
        "verdict",
        "prediction",
        "parameters",
        "sight",
        "residuals",
        "innovations",
        "hover",
        "data",
        "meanings",
        "made",
        "words",
    ]
    assert all(section.folded and section.title.endswith("?") for section in report.sections)
    assert "comparison" in [section.identifier for section in compose(fit(), modes=modes()).sections]
    identifiers = [figure.identifier for figure in report.figures]
    assert len(identifiers) == len(set(identifiers))
    for figure in report.figures:
        assert figure.alt
        assert figure.caption
        json.dumps(figure.spec, allow_nan=False)


def test_every_link_has_its_anchor() -> None:
    report = compose(fit(), validation(), modes=modes())
    cells = [
        c for s in report.sections for block in s.blocks if isinstance(block, Table) for row in block.rows for c in row
    ]
    links, anchors = {c.link for c in cells if c.link}, [c.anchor for c in cells if c.anchor]
    assert links
    assert links <= set(anchors)
    assert len(anchors) == len(set(anchors))


def test_parameter_row_says_where_its_value_comes_from() -> None:
    report = compose(fit(failed=True), modes=modes())
    section = next(s for s in report.sections if s.identifier == "parameters")
    table = next(b for b in section.blocks if isinstance(b, Table))
    rows = {row[0].words: [cell.words for cell in row] for row in table.rows}
    assert rows["inertia_zz"][-1] == "at its physical bound [1e-6, 1]; prior 0.00028 ± 0.00015"
    assert rows["a_beta_u"][-1] == "tied: = a_alpha_v"
    assert rows["linkage_lower"][6] == "-19 %"
    assert rows["damping_r"][6] == "new"


def test_examples_that_overlap_are_not_drawn_over_each_other() -> None:
    chosen = apart(validation().examples)
    assert [example.start for example in chosen] == [2.0, 6.0, 9.0, 13.0]


def test_every_judged_channel_says_what_its_fit_stands_beside() -> None:
    (section,) = (s for s in compose(None, validation(), modes=modes()).sections if s.identifier == "prediction")
    (beside,) = (b for b in section.blocks if isinstance(b, Table) and "stand beside" in b.caption)
    cells = {row[0].words: [cell.words for cell in row] for row in beside.rows}
    assert {name: row[1] for name, row in cells.items()} == {n: f"{at:g}" for n, at in JUDGED_AT.items() if n in cells}
    assert cells["psi"][-1] == "refused"
    assert cells["phi"][-1] != "refused"
    without = compose(None, replace(validation(), floors=()), modes=modes())
    assert not any("stand beside" in getattr(b, "caption", "") for s in without.sections for b in s.blocks)


def test_the_same_inputs_are_drawn_once() -> None:
    report = compose(fit(), validation(), modes=modes())
    panels = [
        json.dumps([[t.get("x"), t.get("y")] for t in figure.spec["data"] if t.get("xaxis", "x") == axis])
        for figure in report.figures
        for axis in {t.get("xaxis", "x") for t in figure.spec["data"]}
    ]
    assert len(panels) == len(set(panels))


def test_words_of_the_page_are_explained_and_no_others() -> None:
    (words,) = (s for s in compose(fit(), validation(), modes=modes()).sections if s.identifier == "words")
    (table,) = (block for block in words.blocks if isinstance(block, Table))
    told = {row[0].words for row in table.rows}
    assert {"ceiling", "fit", "prior share", "residual", "σ"} <= told
    assert "disc margin" not in told
    assert told <= set(TERMS)


def test_tables_refuse_ragged_rows() -> None:
    with pytest.raises(ValueError, match="different lengths"):
        Table("t", ("a", "b"), ((Cell("1"),),))


def test_nothing_to_report_is_an_error() -> None:
    with pytest.raises(SwashError, match="nothing to report"):
        compose()


def test_hashes_follow_the_numbers_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    one = fit()
    assert result_hash(one.to_document()) == result_hash(replace(one, seconds=99.0).to_document())
    assert result_hash(one.to_document()) != result_hash(replace(one, settings={"choice": "flight"}).to_document())
    card = one.model.card
    assert card_hash(card) == card_hash(replace(card, path="elsewhere.toml"))
    assert card_hash(card) != card_hash(one.start.card)
    assert card_hash(replace(card, title="m\udce4rz.csv")) == card_hash(replace(card, title="m?rz.csv"))
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    assert date() == "1970-01-01 00:00 UTC"


def test_a_vehicle_without_hover_says_why() -> None:
    sound = fit()
    heavy = replace(sound, solution=sound.model.with_values({"mass": 1.9}))
    found, problems = hover_modes(heavy, None)
    assert set(found) == {"published"}
    assert "identified vehicle has no eigenvalues" in problems[0]


def test_no_plot_may_be_drawn_over_a_section_of_its_name() -> None:
    section = Section("cost", "Cost", (cost_history([2.0, 1.0]),))
    with pytest.raises(ValueError, match="called cost"):
        Report(title="", banners=(), summary=(), picture=None, sections=(section,), made="")


def test_what_the_first_seconds_told_is_shown_and_a_wind_nobody_asked_for_is_not() -> None:
    report = compose(None, validation(), modes=modes())
    tables = {b.caption: b for s in report.sections for b in s.blocks if isinstance(b, Table)}
    told = tables["What belongs to the predicted flights and not to the vehicle"]
    assert [[cell.words for cell in row][::2] for row in told.rows] == [["delay_servo", "s"], ["lever_y", "m"]]
    assert [row[-1].words for row in told.rows] == ["0.092", "0.156"]
    noise = next(row[-1].words for row in tables["Settings"].rows if row[0].words == "noise")
    assert noise == "gust_tilt 3"
    assert noise_told({"wind": 0.1, "speed": 0.2}) == {"wind": 0.1, "speed": 0.2}


def test_the_best_predictor_is_bold_and_residuals_are_in_units_that_can_be_read() -> None:
    seen = validation()
    report = compose(fit(), seen, modes=modes())
    tables = [block for section in report.sections for block in section.blocks if isinstance(block, Table)]
    (fits,) = (table for table in tables if table.caption == "Fit [%] of every predictor")
    scores = {(s.channel, s.predictor): s.fit for s in seen.scores if s.horizon == HORIZONS[0]}
    at = [k for k, name in enumerate(fits.columns) if name == f"{HORIZONS[0]:g} s"]
    rated = [p for p in PREDICTORS if p != "hold"]
    for row in fits.rows:
        best = max(0.0, *(scores[row[0].words, p] for p in rated))
        assert [row[k].strong for k in at] == [scores[row[0].words, p] == best for p in rated]
    residuals = next(figure for figure in report.figures if figure.identifier == "residual-time")
    told = [value["title"]["text"] for key, value in residuals.spec["layout"].items() if key.startswith("yaxis")]
    assert told[0] in ("x [m]", "x [mm]")
    assert "phi [deg]" in told


def test_phase_axes_have_marks_at_multiples_of_45_degrees() -> None:
    assert [phase_ticks([0.0, -span])["dtick"] for span in (60.0, 90.0, 200.0, 400.0, 700.0, 3000.0)] == [
        15,
        30,
        45,
        90,
        180,
        360,
    ]
    assert phase_ticks([np.nan])["dtick"] == 45


def test_the_truth_of_a_simulated_aircraft_stands_beside_both(tmp_path: Path) -> None:
    """Published, identified and true in one row, on the screen, in the report and after a file; else no such column."""
    plain = fit()
    known = replace(plain, truth={"linkage_lower": 0.111, "tau_f_upper": 1.5})
    assert known.beside_truth == "1 of 2 parameters lie within two sigmas of the simulated aircraft's."
    for made, there in ((known, True), (plain, False), (result_file.load(known.save(tmp_path / "fit.json")), True)):
        table = next(block for block in parameters(made).blocks if isinstance(block, Table))
        assert ("truth" in table.columns) is there
        assert {len(row) for row in table.rows} == {len(table.columns)}
        assert ("0.111" in fit_table(made).text(100)) is there
    assert "truth" not in result_file.to_document(plain)
