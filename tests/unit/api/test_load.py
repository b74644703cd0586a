"""What is saved is read back by `sp.load`, whatever it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from shown_results import responses, sweep
from swashplate.errors import SwashError


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


@pytest.mark.parametrize("name", ["none.nc", "none.toml", "none.json", "text.nc", "text.toml", "text.json"])
def test_what_is_no_result_is_an_error_in_words(name: str, tmp_path: Path) -> None:
    if name.startswith("text"):
        (tmp_path / name).write_text("this is no result")
    with pytest.raises(SwashError, match=name):
        sp.load(tmp_path / name)
