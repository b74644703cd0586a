"""The page's server: who may ask, what a file may be, and that bad input gives words and no traceback."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `live` is not installed")

import httpx

from logs_page import Asking, table
from swashplate.errors import SwashError
from swashplate.links.logs import app, uploads
from swashplate.links.logs.uploads import Uploads, safe_name


@pytest.fixture(scope="module")
def asking() -> Iterator[Asking]:
    made = Asking()
    yield made
    made.close()


def test_other_pages_and_other_names_are_refused(asking: Asking) -> None:
    port = asking.url.rstrip("/").rpartition(":")[2]
    assert asking.client.get("/").status_code == 200
    assert "default-src 'self'" in asking.client.get("/").headers["content-security-policy"]
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1.evil.example", "10.0.0.7"):
        assert httpx.get(asking.url + "logs", headers={"host": host}).status_code == 403
    body = {"name": "a.csv", "size": 10}
    for origin in ("http://evil.example", "null", f"http://127.0.0.1:{int(port) + 1}", "file://"):
        assert httpx.post(asking.url + "upload", json=body, headers={"origin": origin}).status_code == 403
    assert httpx.post(asking.url + "upload", json=body).status_code == 403, "nor one that names no page"


def test_nothing_else_of_the_machine_is_served(asking: Asking) -> None:
    for path in ("open/../app.py", "open/%2e%2e/app.py", "page/%2e%2e/server.py", "etc/passwd", "open//etc/passwd"):
        assert asking.client.get("/" + path).status_code == 404
    assert asking.client.get("/open/open.js").status_code == 200
    assert asking.client.get("/page/vendor/uPlot.esm.js").status_code in (200, 404)


@pytest.mark.parametrize(
    ("name", "kept"),
    [
        ("../../etc/passwd", "passwd"),
        ("C:\\flights\\a.bin", "a.bin"),
        ("/home/pilot/x.csv", "x.csv"),
        ("..", "log"),
        ("-rf", "rf"),
        ("a\x00b\n.csv", "a_b_.csv"),
        ("flight (2).BIN", "flight (2).BIN"),
        ("x" * 500 + ".csv", "x" * 116 + ".csv"),
    ],
)
def test_a_dropped_files_name_leads_nowhere(name: str, kept: str) -> None:
    assert safe_name(name) == kept


def test_a_log_is_dropped_in_pieces_and_described(asking: Asking, tmp_path: Path) -> None:
    number = asking.drop("../a.csv", table(tmp_path / "a.csv"), piece=20_000)
    log = asking.log(number)
    assert (log["name"], log["state"]) == ("a.csv", "ready")
    assert [group["title"] for group in log["groups"]] == ["Rates", "Attitude"]
    assert [c["unit"] for c in log["groups"][0]["channels"]] == ["deg/s", "deg/s"]
    assert log["code"]["shell"] == "swash inspect a.csv"
    (trace,) = asking.post("/traces", wanted=[[number, "p", 0.0, 30.0]], bins=50)["traces"]
    assert trace["thinned"]
    assert len(trace["time"]) == len(trace["values"]) <= 100
    (near,) = asking.post("/traces", wanted=[[number, "phi", 1.0, 1.1]], bins=50)["traces"]
    assert not near["thinned"]
    flight = asking.desk.log(number).ready
    inside = np.degrees(flight.values("phi"))[np.searchsorted(flight.time("phi"), near["time"])]
    assert near["values"] == pytest.approx(inside.tolist())


def test_a_remedy_is_applied_and_the_log_read_anew(asking: Asking, tmp_path: Path) -> None:
    number = asking.drop("flipped.csv", table(tmp_path / "b.csv", flip=True))
    before = asking.log(number)
    mends = [p["remedy"] for p in before["problems"] if p["remedy"]]
    assert [mend["words"] for mend in mends] == ["--unit p=-rad/s"]
    after = asking.post("/apply", log=number, units=mends[0]["units"], drop_bad_stamps=False)
    assert after["version"] == before["version"] + 1
    assert not [p for p in after["problems"] if p["remedy"]]
    assert after["code"]["shell"] == "swash inspect flipped.csv --unit p=-rad/s"


def test_two_logs_are_aligned_by_their_motion(asking: Asking, tmp_path: Path) -> None:
    first = asking.drop("one.csv", table(tmp_path / "c.csv", seed=4))
    second = asking.drop("two.csv", table(tmp_path / "d.csv", seed=4, shift=2.5))
    assert asking.post("/align", first=first, second=second)["offset"] == pytest.approx(-2.5, abs=0.01)
    assert asking.post("/common", numbers=[first, second])["words"] == ""
    other = asking.drop("three.csv", table(tmp_path / "e.csv", names="alpha_lower beta_lower p_imu q_imu"))
    assert "share no channel" in asking.post("/common", numbers=[first, other])["words"]
    status, words = asking.refused("/align", first=first, second=other)
    assert status == 422
    assert "share no motion" in words
    for number in (first, second, other):
        asking.post("/close", log=number)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("photo.jpg", b"\xff\xd8\xff\xe0" + bytes(200), "no flight log that is known"),
        ("cut.nc", b"\x89HDF\r\n\x1a\n" + bytes(64), ""),
        ("words.csv", b"these are words\nno numbers\n", ""),
        ("head.csv", b"time [s],p [rad/s]\n", ""),
        ("zip.zip", b"PK\x03\x04" + bytes(100), ""),
    ],
)
def test_what_is_no_log_is_told_in_words(asking: Asking, name: str, content: bytes, words: str) -> None:
    number = asking.drop(name, content)
    log = asking.log(number)
    assert log["state"] == "failed"
    assert log["problem"]
    assert words in log["problem"]
    assert "Traceback" not in log["problem"] + log["hint"]
    assert asking.refused("/traces", wanted=[[number, "p", 0.0, 1.0]], bins=10)[0] == 422
    asking.post("/close", log=number)


def test_what_is_empty_or_too_large_is_told_before_it_is_sent(asking: Asking) -> None:
    assert asking.refused("/upload", name="a.bin", size=0) == (422, "is empty: there is nothing in it to read.")
    status, words = asking.refused("/upload", name="a.bin", size=uploads.LARGEST + 1)
    assert (status, "at most 1000 MB" in words) == (422, True)


def test_a_piece_that_is_too_large_out_of_turn_or_of_no_file_is_refused(asking: Asking) -> None:
    token = asking.post("/upload", name="a.csv", size=10)["token"]
    assert asking.client.post(f"/upload/{token}/0", content=bytes(uploads.PIECE + 1)).status_code == 400
    assert asking.client.post(f"/upload/{token}/5", content=b"12345").status_code == 422
    assert asking.client.post(f"/upload/{token}/0", content=b"12345").status_code == 422, "it is no more on its way"
    token = asking.post("/upload", name="a.csv", size=10)["token"]
    assert asking.client.post(f"/upload/{token}/0", content=b"12345678901").status_code == 422
    assert asking.client.post("/upload/nosuch/0", content=b"1").status_code == 422


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"[]",
        b"{",
        b'{"wanted": [], "bins": 10, "also": 1}',
        b'{"wanted": [[1, "p", 0]], "bins": 10}',
        b'{"wanted": [["1", "p", 0, 1]], "bins": 10}',
        b'{"wanted": [[1, "p", NaN, 1]], "bins": 10}',
        b'{"wanted": [[1, "p", 0, 1e999]], "bins": 10}',
        b'{"wanted": [], "bins": 1e9}',
        b'{"wanted": [], "bins": true}',
        b"[" * 60_000,
        b"x" * 70_000,
    ],
)
def test_a_request_of_another_form_is_refused(asking: Asking, content: bytes) -> None:
    answer = asking.client.post("/traces", content=content)
    assert answer.status_code == 400
    assert answer.json()["problem"].startswith("the request ")


def test_what_has_no_motion_has_no_track_and_too_short_a_stretch_no_spectrum(asking: Asking, tmp_path: Path) -> None:
    number = asking.drop("g.csv", table(tmp_path / "g.csv", names="alpha_lower beta_lower p q"))
    status, words = asking.refused("/track", log=number)
    assert (status, "no place" in words) == (422, True)
    status, words = asking.refused("/spectra", log=number, channel="p", start=1.0, stop=1.1)
    assert (status, "expected at least 32" in words) == (422, True)
    picture = asking.post("/spectra", log=number, channel="p", start=0.0, stop=30.0)["picture"]
    assert {len(row) for row in picture["shade"]} == {len(picture["shade"][0])}
    assert max(max(row) for row in picture["shade"]) == 255


def test_a_log_or_channel_that_is_none_is_told(asking: Asking, tmp_path: Path) -> None:
    assert asking.refused("/traces", wanted=[[999, "p", 0.0, 1.0]], bins=10) == (422, "log 999 is not open.")
    number = asking.drop("f.csv", table(tmp_path / "f.csv"))
    status, words = asking.refused("/traces", wanted=[[number, "nosuch", 0.0, 1.0]], bins=10)
    assert (status, "no such channel" in words) == (422, True)


def test_what_goes_wrong_inside_is_told_without_a_traceback(
    asking: Asking, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("by nought")

    monkeypatch.setattr(asking.desk, "traces", broken)
    answer = asking.client.post("/traces", json={"wanted": [], "bins": 10})
    assert answer.status_code == 500
    assert "went wrong inside swash (ZeroDivisionError: by nought)" in answer.json()["problem"]
    assert "Traceback" not in answer.text
    assert len(caplog.records) == 1


def test_files_on_their_way_do_not_pile_up_and_go_at_the_end() -> None:
    held = Uploads()
    tokens = [held.begin(f"{k}.bin", 100) for k in range(uploads.MOST + 2)]
    with pytest.raises(SwashError, match="on its way"):
        held.add(tokens[0], 0, b"1")
    path = held.add(tokens[-1], 0, bytes(100))
    assert path is not None
    assert path.read_bytes() == bytes(100)
    held.close()
    assert not path.exists()


def test_every_file_of_the_page_asks_for_nothing_from_elsewhere() -> None:
    for path in sorted(app.PAGE.iterdir()):
        text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert "http://" not in text
        assert "https://" not in text
        assert "innerHTML" not in text
        assert "eval(" not in text
