"""Results: written whole and read back whole, whatever found them; damage is named; draws follow the covariance."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import report_samples
import swashplate as sp
from made_results import result
from swashplate.errors import CardError, DocumentError, IdentificationError
from swashplate.identification.core.result import Result
from swashplate.models.linear.state_space import StateSpaceModel
from swashplate.models.linear.state_space_file import to_toml
from swashplate.models.vehicle import Vehicle
from swashplate.reporting.sections_fit import parameters
from swashplate.reporting.structure import Text

COVARIANCE = np.array([[0.01, 0.0008], [0.0008, 0.0001]])
VALUES = {"tau_f_upper": 1.5, "linkage_lower": 0.13}


def same(one: Any, other: Any) -> bool:
    """Equal to the last bit, NaN equal to NaN; lists and tuples alike."""
    if isinstance(one, Vehicle):
        return same(one.card, other.card) and one.state_names == other.state_names
    if isinstance(one, StateSpaceModel):
        return to_toml(one) == to_toml(other)
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return bool(np.array_equal(np.asarray(one, dtype=complex), np.asarray(other, dtype=complex), equal_nan=True))
    if isinstance(one, float) and np.isnan(one):
        return isinstance(other, float) and np.isnan(other)
    if isinstance(one, dict):
        return isinstance(other, dict) and set(one) == set(other) and all(same(v, other[k]) for k, v in one.items())
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(same(a, b) for a, b in zip(one, other, strict=True))
    if hasattr(one, "__dataclass_fields__"):
        return type(one) is type(other) and all(
            same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one) if f.name != "seconds"
        )
    return bool(one == other)


def test_a_flights_result_comes_back_whole(tmp_path: Path) -> None:
    fit = report_samples.fit()
    again = sp.load(fit.save(tmp_path / "fit.json"))
    for part in fields(Result):
        if part.name != "seconds":
            assert same(getattr(fit, part.name), getattr(again, part.name)), part.name
    assert repr(again) == repr(fit)
    assert again.seconds == 0.0
    again.save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "fit.json").read_bytes()


def test_equal_results_are_equal_files_whatever_the_wall_time(tmp_path: Path) -> None:
    fit = report_samples.fit()
    fit.save(tmp_path / "one.json")
    replace(fit, seconds=99.0).save(tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "fit"}, "kind: is 'fit', expected 'result'"),
        ({"schema": 7}, "schema: is 7, expected 1"),
        ({"names": None}, "names: is nothing, expected a list"),
        ({"names": ["tau_f_upper", "mass"]}, "names: has 'mass', of which there is no estimate"),
        ({"names": ["tau_f_upper"]}, "covariance: is no matrix of 1 by 1"),
        ({"converged": 1}, "converged: is a number, expected true or false"),
        ({"covariance": [[0.01, 0.5], [0.5, 0.0001]]}, "covariance: is no covariance: a correlation lies beyond 1"),
        ({"covariance": [[0.01, 0.0], [0.1, 0.0001]]}, "covariance: is no covariance: expected symmetry"),
        ({"covariance": [[0.01], [0.1, 0.0001]]}, "covariance: has rows of different lengths"),
        ({"covariance": [[0.01, "x"], [0.1, 0.0001]]}, r"covariance\[0\]\[1\]: is a text, expected a number"),
        ({"wings": 2}, "wings: is not known here"),
        ({"details": {"kind": "magic"}}, "details.kind: is 'magic', expected one of"),
        ({"comparisons": [{"kind": "record"}]}, r"comparisons\[0\].record: is missing"),
        ({"model": {"kind": "kite"}}, "model.kind: is 'kite', expected a kind of model"),
    ],
)
def test_damage_is_named(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    document = result(sp.vehicle("coax"), VALUES, COVARIANCE).to_document()
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(document | change))
    with pytest.raises(DocumentError, match=words):
        sp.load(path)


def test_long_records_are_packed_and_damage_in_them_is_found(tmp_path: Path) -> None:
    document = report_samples.fit().to_document()
    packed = document["comparisons"][0]["model"]
    assert set(packed) == {"shape", "packed"}
    packed["shape"] = [3, 3]
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(document))
    with pytest.raises(DocumentError, match=r"comparisons\[0\].model: has 73 bytes of 72"):
        sp.load(path)


def test_a_model_without_known_equations_is_named_and_can_be_given(tmp_path: Path) -> None:
    coax = sp.vehicle("coax")
    own = replace(coax, card=replace(coax.card, vehicle="own"))
    path = result(own, VALUES, COVARIANCE).save(tmp_path / "fit.json")
    with pytest.raises(CardError, match="own"):
        sp.load(path)
    again = sp.load(path, equations=own)
    assert again.model.name == "own"
    assert again.model.card.values() == own.card.values()


def test_draws_are_models_that_the_data_cannot_tell_apart() -> None:
    coax = sp.vehicle("coax")
    fit = result(coax, VALUES, 0.25 * COVARIANCE, corrected=COVARIANCE, ties={"k_zeta_lower": "linkage_lower"})
    drawn = fit.draw_values(4000, seed=1)
    assert drawn["tau_f_upper"].std() == pytest.approx(0.1, rel=0.05)
    assert np.corrcoef(drawn["tau_f_upper"], drawn["linkage_lower"])[0, 1] == pytest.approx(0.8, abs=0.02)
    assert fit.draw_values(4000, seed=1, corrected=False)["tau_f_upper"].std() == pytest.approx(0.05, rel=0.05)
    models = fit.draw(3, seed=1)
    few = fit.draw_values(3, seed=1)
    assert [m.card.values()["tau_f_upper"] for m in models] == list(few["tau_f_upper"])
    assert all(m.card.values()["k_zeta_lower"] == m.card.values()["linkage_lower"] for m in models)
    with pytest.raises(IdentificationError, match="has failed: nothing can be drawn"):
        replace(fit, failed=True).draw(1, seed=0)
    with pytest.raises(IdentificationError, match="linkage_lower: has no standard deviation"):
        result(coax, VALUES, np.diag([0.01, np.inf])).draw(1, seed=0)


def test_a_result_says_what_its_choice_set() -> None:
    told = "choice 'full' sets bar_heading_transport = 1 (card: 0)"
    fit = report_samples.fit()
    assert told not in repr(fit)
    fit = replace(fit, settings={**fit.settings, "set by the choice": [told]})
    assert f"\n  {told}\n" in repr(fit)
    assert Text(f"{told}.") in parameters(fit).blocks


def test_a_result_shows_itself_in_notebooks() -> None:
    shown = report_samples.fit()._repr_html_()
    assert "<td>linkage_lower</td>" in shown
    assert "coax by filter-error: converged" in shown
