"""A log as a page to send: nothing personal in its bytes unless asked for, curves as they were, thinned where large."""

from __future__ import annotations

import base64
import gzip
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swashplate.errors import ExportError
from swashplate.flights.flight import Flight
from swashplate.flights.provenance import Event, Provenance
from swashplate.links.logs import sent_page as sent
from swashplate.links.logs.personal import KINDS
from swashplate.links.web.libraries import PAGE

HOSTILE = "</script><b onclick=alert(1)>"
LATITUDE, LONGITUDE, EPOCH = 0.823456, 0.187654, 1.7e9
SECRETS = {
    "names": "Wendelin",
    "messages": "003A0025 3230510E",
    "serials": "INS_ACC_ID",
    "others": "my_shed",
    "place": "latitude",
    "date": "1700000000",
}
"""A text of each kind that is in a page exactly where it is asked for."""


@pytest.fixture(autouse=True)
def libraries() -> None:
    if not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")


def flight(*, seconds: float = 20.0, rate: float = 100.0) -> Flight:
    time = np.arange(0.0, seconds, 1.0 / rate)
    time = time[(time < 8.0) | (time > 9.5)]  # a gap
    chance = np.random.default_rng(3)
    values = {
        name: 0.1 * chance.standard_normal(time.size) for name in ("p", "q", "r", "x", "y", "z", "my_shed", HOSTILE)
    }
    values["latitude"], values["longitude"] = LATITUDE + 1e-7 * time, LONGITUDE + 1e-7 * time
    made = Flight.from_arrays(time, values, source="Wendelins Logo 550.bbl")
    events = (
        Event(1.0, "message", "CubeOrange 003A0025 3230510E 39373833"),
        Event(2.0, "mode", "STABILIZE"),
        Event(3.0, "parameter", "INS_ACC_ID 2621706", {"name": "INS_ACC_ID", "value": 2621706.0}),
    )
    parameters = {"roll_p_gain": 50.0, "INS_ACC_ID": 2621706.0, "AHRS_ORIG_LAT": 47.18, "SERIAL1_BAUD": 57.0}
    origin = Provenance(
        "Wendelins Logo 550.bbl", "ab12", "blackbox", "1", False, "Wendelin Rotorflight 4.3.0",
        ("Wendelins Logo 550.bbl: two frames lost",), parameters=parameters, events=events, epoch=EPOCH,
        firmware="Rotorflight 4.3.0",
    )  # fmt: skip
    return replace(made, provenance=origin)


def page(of: Flight, **asked: Any) -> sent.SentPage:
    return sent.sent_page(of, Path("Wendelins Logo 550.bbl"), **asked)


def part(text: str, name: str) -> bytes:
    found = re.search(rf'<script type="([\w/]+)" id="{name}">(.*?)</script>', text)
    assert found is not None
    return found[2].encode() if found[1] == "application/json" else gzip.decompress(base64.b64decode(found[2]))


def curves(text: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Stamps and values of each channel, read from the page as its JavaScript reads them."""
    content, made = part(text, "curves"), {}
    for one in json.loads(part(text, "drawn")):

        def numbers(at: int, kind: str, count: int = one["count"]) -> np.ndarray:
            ranks = np.frombuffer(content, np.uint8, 4 * count, at).reshape(4, count)
            return np.ascontiguousarray(ranks.T).view(kind)[:, 0]

        time = one["begin"] + np.cumsum(numbers(one["time"], "<i4").astype(np.int64)) * one["tick"]
        made[one["channel"]] = time, numbers(one["values"], "<f4")
    return made


def everything(text: str) -> str:
    """All texts of a page, packed ones too, without its own modules."""
    outer = re.sub(r'<script type="text/plain" id="modules">.*?</script>', "", text)
    return "\n".join([outer, *(part(text, name).decode() for name in ("kept", "drawn"))])


def numbers_of(text: str) -> np.ndarray:
    """Every number of a page: of its curves and of all else."""
    found = re.findall(r"-?\d+\.\d+(?:e-?\d+)?", part(text, "kept").decode())
    return np.concatenate([np.array(found, dtype=float), *(values for _, values in curves(text).values())])


def near(text: str, value: float) -> bool:
    """Whether a page has a number that is this one or its degrees, to seven parts in a million."""
    told = numbers_of(text)
    return any(bool(np.any(np.abs(told - one) < 7e-6 * one)) for one in (value, np.degrees(value)))


def test_nothing_personal_is_in_its_bytes_unless_it_is_asked_for() -> None:
    bare, whole = page(flight()), page(flight(), keep=tuple(KINDS))
    for kind, secret in SECRETS.items():
        assert secret not in everything(bare.text).replace("Left out: latitude", ""), (
            kind
        )  # the name of what is not there
        assert secret in everything(whole.text), f"asked for {kind}: the test can fail"
        one = page(flight(), keep=(kind,))
        others = [
            other
            for other, text in SECRETS.items()
            if other != kind and text in re.sub("<p>.*?</p>", "", everything(one.text))
        ]
        assert others == [], f"only {kind} was asked for"
    for value in (LATITUDE, LONGITUDE):
        assert not near(bare.text, value)
        assert near(whole.text, value)
    assert "2621706" not in everything(bare.text)
    assert "47.18" not in everything(bare.text)
    assert {"x", "y", "latitude", "longitude"}.isdisjoint(curves(bare.text))


def test_it_lists_what_is_inside_and_what_was_left_out() -> None:
    made = page(flight(), maker="Made by swashplate.")
    inside, gone, named = made.remarks
    assert inside.startswith(
        "Inside: 4 channels of 20.0 s; 2 parameters; 1 events; findings and review; spectra of p, q, r"
    )
    assert inside.endswith("no fit; no gains.")
    for words in (
        "latitude, longitude, x, y, the map",
        "messages (1)",
        "2 parameters",
        "the date",
    ):
        assert words in gone
    assert named == f"These channels and parameters: my_shed, {HOSTILE}, INS_ACC_ID, AHRS_ORIG_LAT."
    text = everything(made.text)
    assert "Made by swashplate." in text
    assert "SERIAL1_BAUD" in text, "a port's setting is no serial number"
    assert "STABILIZE" in text
    assert '"log.bbl"' in text
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', made.text)
    assert policy is not None
    assert "default-src &#x27;none&#x27;" in policy[1]
    assert not re.search(r"unsafe-eval|https?:|connect-src|script-src[^;]*unsafe-inline", policy[1])
    assert not re.search(r"(?:src|href)=\"(?!data:)", made.text)


def test_a_hostile_name_is_text() -> None:
    made = page(flight(), keep=("others",), maker=HOSTILE)
    assert "<b onclick" not in made.text
    assert HOSTILE in curves(made.text)


def test_curves_are_the_flight_where_nothing_is_thinned() -> None:
    made = flight()
    for name, (time, values) in curves(page(made).text).items():
        good = np.isfinite(values)
        assert good.sum() == made.time(name).size == time.size - 1, "one more, in the gap"
        np.testing.assert_allclose(time[good], made.time(name), atol=1e-6)
        factor = 180.0 / np.pi if name in ("p", "q", "r") else 1.0
        np.testing.assert_allclose(values[good], factor * made.values(name), rtol=1e-6)


def test_a_large_log_is_thinned_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    made = flight(seconds=100.0, rate=400.0)
    whole = page(made)
    assert len(whole.text) > 1_300_000
    monkeypatch.setattr(sent, "LARGEST", 1_150_000)
    less = page(made)
    assert 1_000_000 < len(less.text.encode()) <= 1_150_000
    assert re.search(
        r"Thinned to the lowest and the highest of [\d,]+ bins a channel: p, q, r, z \([\d,]+ of", less.remarks[1]
    )
    for name, (_, values) in curves(less.text).items():
        assert (np.nanmin(values), np.nanmax(values)) == (
            np.nanmin(curves(whole.text)[name][1]),
            np.nanmax(curves(whole.text)[name][1]),
        ), "its extremes stay"
    monkeypatch.setattr(sent, "LARGEST", 1_000)
    with pytest.raises(ExportError, match=r"does not fit into 0.001 MB.*Send a part of it"):
        page(made)


def test_a_kind_that_is_none_and_a_log_of_nothing_else_are_refused() -> None:
    with pytest.raises(ExportError, match=r"keep: is home\. There are place: "):
        page(flight(), keep=("home",))
    only = flight()
    only = replace(only, streams={"a": next(iter(only.streams.values()))[["latitude", "longitude"]]})
    with pytest.raises(ExportError, match=r"has no channel left without what is personal\. Ask"):
        page(only)
