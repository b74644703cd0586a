"""Units given for logs that name their own: the finding's advice can be followed on every log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from logs_page import table
from swashplate.errors import UnitError


def _saved(folder: Path, **units: str) -> Path:
    """A flight of half a minute with a flipped roll rate, saved as netCDF."""
    table(folder / "flight.csv", flip=True)
    return sp.read(folder / "flight.csv", units=units).save(folder / "flight.nc")


def test_the_advice_on_a_flipped_gyro_can_be_followed(tmp_path: Path) -> None:
    path = _saved(tmp_path)
    told = [problem for problem in sp.inspect(sp.read(path)).problems if "other sign" in problem]
    assert len(told) == 1
    assert "--unit p=-rad/s" in told[0]
    mended = sp.read(path, units={"p": "-rad/s"})
    assert mended.values("p").tolist() == (-sp.read(path).values("p")).tolist()
    assert mended.values("q").tolist() == sp.read(path).values("q").tolist()
    assert not any("other sign" in problem for problem in sp.inspect(mended).problems)
    assert any("p: taken in -rad/s" in note for note in mended.provenance.notes)


def test_the_unit_stands_in_place_of_the_one_that_was_logged(tmp_path: Path) -> None:
    """A file that was read in degrees keeps that: its sign alone is mended, and not its degrees once more."""
    path = _saved(tmp_path, p="deg/s")
    before = sp.read(path).values("p")
    assert sp.read(path, units={"p": "-deg/s"}).values("p") == pytest.approx(-before, rel=1e-14)
    assert sp.read(path, units={"p": "rad/s"}).values("p") == pytest.approx(np.degrees(before), rel=1e-14)


def test_what_cannot_be_meant_is_refused(tmp_path: Path) -> None:
    path = _saved(tmp_path)
    with pytest.raises(UnitError, match=r"flight\.nc: p: unit 'm' is a unit of"):
        sp.read(path, units={"p": "m"})
    with pytest.raises(UnitError, match=r"thta: .*log lacks.*Did you mean 'theta'"):
        sp.read(path, units={"thta": "deg"})
