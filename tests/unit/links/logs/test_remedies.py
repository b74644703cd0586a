"""The options that messages name are those that a reading takes: the messages are the program's own."""

from __future__ import annotations

import numpy as np
import pytest

import swashplate as sp
from swashplate.flights.consistency import consistency
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.remedies import Remedy, remedy


@pytest.mark.parametrize(
    ("text", "units", "drop"),
    [
        ("q: has the other sign (ratio -1). Give --unit q=-rad/s.", {"q": "-rad/s"}, False),
        ("Give --unit theta=deg (and phi, psi alike).", {"theta": "deg", "phi": "deg", "psi": "deg"}, False),
        ("Write it in the header, or give what it is, as --unit p=rad/s --unit az=m/s^2 (in Python units={}).",
         {"p": "rad/s", "az": "m/s^2"}, False),
        ("Repair the log, or leave these samples out: --drop-bad-stamps (in Python bad_stamps='drop').", {}, True),
        ("Give --unit inputs=% (in Python units={'inputs': '%'}) if it is in percent.", {"inputs": "%"}, False),
    ],
)  # fmt: skip
def test_options_are_found_in_a_message(text: str, units: dict[str, str], drop: bool) -> None:
    found = remedy(text)
    assert found == Remedy(units, drop)
    assert found.option_text


def test_a_message_without_an_option_has_no_remedy() -> None:
    assert remedy("omega_rotor: never moves, so nothing can be learnt from it") is None
    assert remedy("Check its unit.") is None


def test_a_finding_of_the_program_is_mended_by_its_remedy(tmp_path) -> None:  # type: ignore[no-untyped-def]
    time = np.arange(0.0, 40.0, 0.02)
    angle = 0.2 * np.sin(2.0 * np.pi * 0.7 * time)
    rate = np.gradient(angle, time)
    rows = [f"{t!r},{a!r},0,{-r!r},0" for t, a, r in zip(time.tolist(), angle.tolist(), rate.tolist(), strict=True)]
    file = tmp_path / "flight.csv"
    file.write_text("time [s],phi [rad],theta [rad],p [rad/s],q [rad/s]\n" + "\n".join(rows) + "\n")
    found = consistency(sp.read(file))
    mend = remedy(str(found[0]))
    assert mend is not None
    assert mend.units == {"p": "-rad/s"}
    assert consistency(sp.read(file, units=dict(mend.units))) == ()


def test_remedies_add_up() -> None:
    read = Read("a.csv").with_remedy(Remedy({"p": "deg/s"})).with_remedy(Remedy({"q": "-rad/s"}, True))
    assert read.option_text == "--unit p=deg/s --unit q=-rad/s --drop-bad-stamps"
    assert read.python() == "flight = sp.read('a.csv', units={'p': 'deg/s', 'q': '-rad/s'}, bad_stamps=\"drop\")"
