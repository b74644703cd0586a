"""What is saved is read back by `sp.load`, whatever it is."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from report_samples import validation
from shown_results import responses, sweep
from swashplate.errors import SwashError
from swashplate.reporting.figures.views import section_of
from swashplate.reporting.structure import Figure

FORMS = {"lag": "0/1", "gain": "0/0"}


def test_what_was_saved_comes_back(tmp_path: Path) -> None:
    flown, answered = sweep(), responses()
    fit = sp.fit_transfer_function(answered, "0/1", input="servo_roll", outputs=["p"])
    flown.save(tmp_path / "flight.nc")
    answered.save(tmp_path / "responses.nc")
    fit.save(tmp_path / "fit.json")
    sp.vehicle("raptor50").save(tmp_path / "card.toml")
    again = {file.name: sp.load(file) for file in tmp_path.iterdir()}
    np.testing.assert_array_equal(again["flight.nc"].values("p"), flown.values("p"))  # type: ignore[union-attr]
    np.testing.assert_array_equal(again["responses.nc"].response, answered.response)  # type: ignore[union-attr]
    assert repr(again["fit.json"]) == repr(fit)
    assert again["card.toml"].card.values() == sp.vehicle("raptor50").card.values()  # type: ignore[union-attr]
    with pytest.raises(SwashError, match="are for a fit"):
        sp.load(tmp_path / "flight.nc", equations=sp.vehicle("coax"))


def test_judgements_come_back_whole(tmp_path: Path) -> None:
    """What they print, draw and report is the same after a file."""
    flown, answered = sweep(), responses()
    fits = {k: sp.fit_transfer_function(answered, form, input="servo_roll", outputs=["p"]) for k, form in FORMS.items()}
    left = sp.residuals(fits["lag"], flown)
    alone = left.verification
    inside = replace(alone, settings={**alone.settings, "band_hz": [0.1, 5.0]})
    made = [sp.compare(fits, flown), left, alone, replace(alone, inside=inside)]
    for k, judged in enumerate((*made, validation())):
        file = judged.save(tmp_path / f"{k}.json")
        again = sp.load(file)
        assert type(again) is type(judged)
        assert repr(again) == repr(judged)
        assert again.save(tmp_path / "again.json").read_text() == file.read_text()
        assert [f.spec for f in again_drawn(again)] == [f.spec for f in again_drawn(judged)]
    assert again.data[0].same_log(validation().data[0])  # type: ignore[union-attr]  # the last one: a validation


def again_drawn(judged: Any) -> list[Figure]:
    return [block for block in section_of(judged).blocks if isinstance(block, Figure)]


@lru_cache(maxsize=1)
def saved_judgement() -> str:
    fit = sp.fit_transfer_function(responses(), "0/1", input="servo_roll", outputs=["p"])
    with TemporaryDirectory() as folder:
        return sp.residuals(fit, sweep()).save(Path(folder) / "left.json").read_text()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.pop("saved"), "holds figures only"),
        (lambda d: d.update(schema=2), "expected 1"),
        (lambda d: d["saved"].pop("auto"), "saved.auto: is missing"),
        (lambda d: d["saved"].update(odd=1), "saved.odd: is not known"),
        (lambda d: d["saved"]["verification"].update(cost="much"), "saved.verification.cost: is a text"),
        (lambda d: d["saved"]["verification"].update(model={}), "saved.verification.model.kind"),
        (lambda d: d.update(saved=3), "is no table"),
    ],
)
def test_a_judgement_that_was_changed_is_refused_by_its_entry(
    change: Callable[[dict[str, Any]], Any], words: str, tmp_path: Path
) -> None:
    document = json.loads(saved_judgement())
    change(document)
    (tmp_path / "left.json").write_text(json.dumps(document))
    with pytest.raises(SwashError, match=rf"left\.json.*{re.escape(words)}"):
        sp.load(tmp_path / "left.json")


@pytest.mark.parametrize("name", ["none.nc", "none.toml", "none.json", "text.nc", "text.toml", "text.json"])
def test_what_is_no_result_is_an_error_in_words(name: str, tmp_path: Path) -> None:
    if name.startswith("text"):
        (tmp_path / name).write_text("this is no result")
    with pytest.raises(SwashError, match=name):
        sp.load(tmp_path / name)
