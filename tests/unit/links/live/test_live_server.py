"""The live page's server: who may ask, what may be said, and that nothing said breaks it."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import logging
import random
import shutil
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import swashplate as sp
from flown_here import World
from swashplate import progress_lines
from swashplate.errors import SwashError
from told_rows import rows, told

pytest.importorskip("starlette", reason="the extra `live` is not installed")

import httpx
import uvicorn
import websockets
from starlette.applications import Starlette
from websockets.sync.client import connect

from swashplate.links.live import identifying, server
from swashplate.links.live.identifying import busiest, commands
from swashplate.links.live.messages import LONGEST, SCHEMA, MessageError, parse
from swashplate.links.live.session import LiveSession
from swashplate.links.web import connections, libraries, serving
from swashplate.links.web.guard import Guard
from swashplate.own_python import own_python

VALID: list[dict[str, Any]] = [
    {"type": "bar", "value": True},
    {"type": "record", "value": True},
    {"type": "identify", "recording": 1, "how": "model"},
    {"type": "stop_identifying"},
    {"type": "learn"},
]


@pytest.mark.parametrize("message", VALID, ids=lambda m: m["type"])
def test_what_the_page_says_is_understood(message: dict[str, Any]) -> None:
    assert parse(json.dumps(message)) == message


def test_every_type_is_tried() -> None:
    assert {message["type"] for message in VALID} == set(SCHEMA)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "null",
        '"stick"',
        "{}",
        '{"type": 3}',
        '{"type": "exec", "value": "1"}',
        '{"type": "record"}',
        '{"type": "record", "value": 1}',
        '{"type": "record", "value": true, "also": 1}',
        '{"type": "identify", "recording": NaN, "how": "model"}',
        '{"type": "identify", "recording": 1e999, "how": "model"}',
        '{"type": "identify", "recording": true, "how": "model"}',
        '{"type": "identify", "recording": 0, "how": "model"}',
        '{"type": "identify", "recording": 1, "how": ["model"]}',
        '{"type": "identify", "recording": "../1", "how": "model"}',
        '{"type": "identify", "recording": 1.0, "how": "model"}',
        '{"type": "identify", "recording": 1, "how": "rm"}',
        "[" * 1500,
        '{"type": "learn"}' + " " * LONGEST,
    ],
)
def test_what_the_schema_does_not_allow_is_refused(text: str) -> None:
    with pytest.raises(MessageError):
        parse(text)


def test_mutated_messages_raise_nothing_else() -> None:
    chance, refused = random.Random(5), 0
    for _ in range(20_000):
        text = list(json.dumps(chance.choice(VALID)))
        for _ in range(chance.randint(1, 6)):
            place = chance.randrange(len(text))
            text[place : place + chance.randint(0, 3)] = chr(chance.choice([chance.randint(0, 255), 0x1F600, 0xD800]))
        try:
            message = parse("".join(text))
        except MessageError:
            refused += 1
        else:
            assert message.keys() == {"type", *SCHEMA[message["type"]]}
    assert refused > 15_000


# ---- a server that runs ----------------------------------------------------------------------------------------------
@pytest.fixture(scope="module", autouse=True)
def uncompiled() -> Iterator[None]:
    """What flies is not what is tested here."""
    with pytest.MonkeyPatch.context() as during:
        during.setattr("swashplate.links.live.session.web_assembly", lambda source: b"code")
        yield


class Running:
    """A served session with its address."""

    def __init__(self, folder: Path) -> None:
        self.said: list[str] = []
        self.session = LiveSession(sp.vehicle("coax"), controller=None, folder=folder, tell=self.said.append)
        self.listening = serving.listen("127.0.0.1", 0, allow_remote=False)
        self.url = serving.address_of(self.listening)
        self.host = self.url.removeprefix("http://").rstrip("/")
        self.server = uvicorn.Server(serving.configured(server.live_app(self.session), frame=server.FRAME))
        self.thread = threading.Thread(target=lambda: asyncio.run(self.server.serve(sockets=[self.listening])))
        self.thread.start()

    def socket(self, origin: str | None = None) -> Any:
        return connect(f"ws://{self.host}/socket", origin=origin or f"http://{self.host}")  # type: ignore[arg-type]

    def close(self) -> None:
        self.server.should_exit = True
        self.thread.join(timeout=10.0)
        self.session.close()
        self.listening.close()


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    made = Running(tmp_path_factory.mktemp("live"))
    yield made
    made.close()


def updates(page: Any, until: Any, *, kind: str = "told", most: int = 300) -> dict[str, Any]:
    """The first update of which something is true."""
    for _ in range(most):
        update = json.loads(page.recv(timeout=30.0))
        if update["type"] == kind and until(update):
            return update
    raise AssertionError("never came")


def hello(page: Any) -> dict[str, Any]:
    return updates(page, lambda m: True, kind="model")


def send(page: Any, **message: Any) -> None:
    page.send(json.dumps(message))


def test_a_page_is_given_what_flies(running: Running) -> None:
    with running.socket() as page:
        model = hello(page)
        assert base64.b64decode(model["code"]) == b"code"
        told_ = model["model"]["hello"]
        assert [entry["name"] for entry in told_["inputs"]] == list(running.session.world.vehicle.input_names)
        assert (told_["bar"], told_["barred"], told_["folder"]) == (True, True, str(running.session.folder))
        assert updates(page, lambda m: True)["recordings"] == []


def test_estimates_follow_the_flight_and_begin_anew_after_a_reset(tmp_path: Path) -> None:
    model = sp.vehicle("coax")
    flown = World(model.with_values({"mass": 0.36}), believed=model)
    session = LiveSession(flown.vehicle, controller=None, folder=tmp_path, estimate=["mass"], model=model)
    assert session.hello()["model"]["hello"]["estimates"] == [["mass", "kg"]]
    assert session.report()["estimates"] == [[None, None, 0.302]]

    def fly(count: int, *, first: int) -> None:
        for k in range(count):
            flown.step()
            session.fly(np.array([session.version, first + k, *flown.latest], dtype="<f8").tobytes())

    fly(300, first=1)
    ((value, sigma, said),) = session.report()["estimates"]
    assert abs(value - 0.36) < 3.0 * sigma < 0.02
    assert said == 0.302
    unlearnt, version = session.world.pilot, session.version
    asyncio.run(session.obey({"type": "learn"}))
    learnt = session.world.pilot
    assert session.report()["notice"].startswith("The law now takes mass = 0.3")
    assert not np.array_equal(learnt.gains["attitude", True], unlearnt.gains["attitude", True])
    assert (session.version, session.hello()["goes_on"]) == (version + 1, True)
    assert session.hello()["model"]["gains"]["attitude"][0] == learnt.gains["attitude", True].tolist()
    flown.reset()
    fly(1, first=1)
    assert session.report()["frozen"] == "a clock that jumped"
    fly(1, first=2)
    assert session.report()["frozen"] == ""
    session.close()


def test_the_page_is_given_the_drawn_models(tmp_path: Path) -> None:
    model = sp.vehicle("coax")
    heavy = model.with_values({"mass": 0.31})
    session = LiveSession(model, controller=None, folder=tmp_path, draws=[model, heavy])
    given = json.loads(json.dumps(session.hello()))["model"]
    assert (given["hello"]["fan"], given["sizes"]["crafts"]) == (2, 4)
    assert given["draws"][0] == given["card"] != given["draws"][1]
    session.close()


def test_rows_that_are_none_are_refused_and_those_of_another_version_let_go(tmp_path: Path) -> None:
    session = LiveSession(sp.vehicle("coax"), controller=None, folder=tmp_path)
    whole = told(session.version, 1, 3)
    session.fly(whole)
    assert session._tick == 3
    session.fly(told(session.version - 1, 4, 2))
    assert session._tick == 3
    with_nan = np.frombuffer(whole, "<f8").copy()
    with_nan[5] = np.nan
    mixed = whole + told(session.version - 1, 4, 1)
    for bad in (b"", whole[:-1], whole[:-8], with_nan.tobytes(), mixed):
        with pytest.raises(MessageError, match="bad rows"):
            session.fly(bad)
    session.close()


def test_what_the_equations_do_not_hold_for_is_told(tmp_path: Path) -> None:
    session = LiveSession(sp.vehicle("coax"), controller=None, folder=tmp_path)
    session.fly(told(session.version, 1, 60))
    assert session.report()["doubts"] == ""
    fast = rows(60)
    fast[:, 3] = 30.0
    numbered = np.column_stack([np.full(60, session.version), np.arange(61, 121), fast])
    session.fly(numbered.astype("<f8").tobytes())
    assert "Its air speed is 30.0 m/s" in session.report()["doubts"]
    session.close()


def test_refused_messages_are_logged_once_and_end_the_connection(
    running: Running, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, logger="swashplate.live"), running.socket() as page:
        for _ in range(server.MOST_BAD + 1):
            page.send('{"type": "nonsense"}')
        with pytest.raises(websockets.ConnectionClosed) as closed:
            updates(page, lambda m: False)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008
    assert [record.getMessage() for record in caplog.records] == ["A page's message was refused: unknown type."]


def test_a_recording_and_what_cannot_be_done(running: Running) -> None:
    with running.socket() as page:
        version = hello(page)["version"]
        send(page, type="identify", recording=99, how="model")
        assert updates(page, lambda m: m["notice"])["notice"] == "There is no recording 99."
        send(page, type="record", value=True)
        page.send(told(version, 1, 230))
        updates(page, lambda m: m["recording"] == 2.3)
        send(page, type="record", value=False)
        number, seconds = updates(page, lambda m: m["recordings"])["recordings"][-1]
        assert seconds == pytest.approx(2.3, abs=0.05)
        assert (running.session.folder / f"recording-{number}.nc").is_file()


def test_a_page_that_goes_leaves_its_recording_saved_and_another_flies(running: Running) -> None:
    with running.socket() as page, running.socket() as other:
        version = hello(page)["version"]
        send(page, type="record", value=True)
        updates(page, lambda m: m["recording"] == 0.0)
        other.send(told(version, 1, 100))  # of another flight
        assert updates(other, lambda m: m["doubts"])["doubts"] == server.ELSEWHERE
        page.send(told(version, 1, 210))
        updates(page, lambda m: m["recording"] == 2.1)
        known = len(running.session.recordings)
        page.close()
        updates(other, lambda m: len(m["recordings"]) == known + 1)
        assert "is saved: " in running.said[-1]
        send(other, type="record", value=True)
        other.send(told(version, 101, 50))
        updates(other, lambda m: m["recording"] == 0.5)
        other.send(told(version, 1, 50))  # it was put back to its start, and did not say so
        assert "began anew" in updates(other, lambda m: m["notice"])["notice"]
        send(other, type="record", value=False)
        updates(other, lambda m: "expected at least 2 s" in m["notice"])


def test_what_a_recording_is_identified_with(tmp_path: Path) -> None:
    raptor, coax = sp.vehicle("raptor50"), sp.vehicle("coax")
    first, second = commands(raptor, tmp_path / "f.nc", card=tmp_path / "c.toml", out=tmp_path / "out")
    assert first[:3] == own_python("swashplate.__main__")[:3]
    assert first[4] == "identify"
    cheap = ["--flight", str(tmp_path / "f.nc"), "--free", "rotor", "--method", "output-error", "--rate", "50"]
    assert first[-8:] == cheap
    (windowed, _) = commands(
        raptor, tmp_path / "f.nc", card=tmp_path / "c.toml", out=tmp_path / "out", window=(12.5, 32.5)
    )
    assert f"{tmp_path / 'f.nc'}@12.5-32.5" in windowed
    assert second[4:6] == ["respond", str(tmp_path / "f.nc")]
    assert "throttle" not in " ".join(second)
    assert len(commands(coax, tmp_path / "f.nc", card=tmp_path / "c.toml", out=tmp_path / "out")) == 2
    (only,) = commands(coax, tmp_path / "f.nc", card=tmp_path / "c.toml", out=tmp_path / "out", how="responses")
    assert only[4] == "respond"


@pytest.mark.parametrize(
    ("ways", "state", "words"),
    [
        (["exit 3", "touch out/report.html"], "done", "No model could be fitted to it"),
        (
            ["touch out/report.html; echo 'The fit failed: wide.' >&2; exit 2", "exit 9"],
            "done",
            "The fit failed: wide.",
        ),
        (["echo first >&2; exit 2", "echo second >&2; exit 2"], "failed", "second"),
        (["touch out/report.html"], "done", ""),
    ],
)
def test_the_second_way_is_taken_where_the_first_leaves_no_report(
    ways: list[str], state: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "out").mkdir()
    chosen = tuple(["sh", "-c", f"cd {tmp_path}; {way}"] for way in ways)
    monkeypatch.setattr(identifying, "commands", lambda *_, **__: chosen)
    monkeypatch.setattr(identifying.Identifying, "out", lambda self, number: tmp_path / "out")
    job = identifying.Identifying(tmp_path)
    asyncio.run(job.run(sp.vehicle("raptor50"), 1))
    assert job.job is not None
    assert job.job.state == state
    assert job.job.outcome.startswith(words)
    assert bool(job.job.outcome) == bool(words)


def test_a_long_recording_is_identified_from_where_its_sticks_move() -> None:
    inputs = np.zeros((6000, 3))  # a minute
    inputs[3500:4500, 0] = 0.1 * np.sign(np.sin(0.1 * np.arange(1000)))
    inputs[:, 1] = 1e-6 * np.sin(np.arange(6000))
    window = busiest(inputs, period=0.01, seconds=20.0)
    assert window is not None
    assert window[1] - window[0] == pytest.approx(20.0)
    assert window[0] <= 35.0
    assert window[1] >= 45.0
    assert busiest(inputs[:2000], period=0.01, seconds=20.0) is None


def test_an_identification_tells_how_far_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = [progress_lines.line(progress_lines.Told("fitting", k, 60)) for k in (1, 2, 3)]
    script = "; sleep 0.2; ".join(f"echo '{line}' >&2" for line in said)
    held = f"echo other words >&2; {script}; touch {tmp_path}/seen; sleep 0.5; exit 2"
    monkeypatch.setattr(identifying, "commands", lambda *_, **__: (["sh", "-c", held],))
    job = identifying.Identifying(tmp_path)

    async def watched() -> identifying.Job:
        task = asyncio.create_task(job.run(sp.vehicle("raptor50"), 1))
        while not (tmp_path / "seen").exists():
            await asyncio.sleep(0.02)
        await asyncio.sleep(0.2)
        assert job.job is not None
        told = job.job
        await task
        return told

    told = asyncio.run(watched())
    assert told.doing == "fitting"
    assert told.share == pytest.approx(3 / identifying.USUAL)
    assert told.left is not None
    assert 0.5 * 0.2 * 22 < told.left < 5.0 * 0.2 * 22
    assert job.job is not None
    assert job.job.outcome == "other words", "progress is no part of what went wrong"


def test_lines_of_progress_are_read_back_and_others_are_left() -> None:
    told = progress_lines.Told("fitting", 3, 60)
    assert progress_lines.parse(progress_lines.line(told)) == told
    assert progress_lines.parse(progress_lines.line(told._replace(total=None))) == told._replace(total=None)
    for text in ("", "fitting", "swash-progress", "swash-progress {", 'swash-progress ["a"]', "swash-progress 3"):
        assert progress_lines.parse(text) is None


def test_the_bar_comes_off(running: Running) -> None:
    with running.socket() as page:
        first = hello(page)
        send(page, type="bar", value=False)
        off = hello(page)
        assert (off["version"], off["goes_on"]) == (first["version"] + 1, False)
        assert not off["model"]["hello"]["barred"]
        assert len(off["model"]["states"]) < len(first["model"]["states"])
        send(page, type="bar", value=True)
        assert hello(page)["model"]["hello"]["barred"]


def test_other_pages_and_other_names_are_refused(running: Running) -> None:
    port = running.host.rpartition(":")[2]
    assert httpx.get(running.url).status_code == 200
    assert "default-src 'self'" in httpx.get(running.url).headers["content-security-policy"]
    assert httpx.get(running.url, headers={"host": f"localhost:{port}"}).status_code == 200
    for host in ("evil.example", f"evil.example:{port}", "", "127.0.0.1.evil.example", "[::1", "10.0.0.7"):
        assert httpx.get(running.url, headers={"host": host}).status_code in (400, 403)
    assert httpx.get(running.url, headers={"origin": "http://evil.example"}).status_code == 403
    assert httpx.post(running.url).status_code == 403, "what changes something names its page"
    assert httpx.post(running.url, headers={"origin": running.url.rstrip("/")}).status_code == 405
    for origin in ("http://evil.example", "null", f"http://127.0.0.1:{int(port) + 1}", "file://"):
        with pytest.raises(websockets.InvalidStatus), running.socket(origin):
            pass


def test_only_reports_and_the_page_are_served(running: Running) -> None:
    long = "9" * 5000  # more digits than Python makes a number of
    for path in ("report/1", "report/-1", "report/x", f"report/{long}", "page/../server.py", "page/%2e%2e/server.py",
                 "recording-1.nc"):  # fmt: skip
        assert httpx.get(running.url + path).status_code == 404


def test_a_page_that_goes_while_it_is_answered_is_no_error(tmp_path: Path) -> None:
    """An update cannot be sent while a message is obeyed: what is asked of the socket after that is not there."""
    session = LiveSession(sp.vehicle("coax"), controller=None, folder=tmp_path)
    gone, obeyed = asyncio.Event(), []

    async def obey(message: dict[str, Any]) -> None:
        await gone.wait()
        obeyed.append(message)

    session.obey = obey  # type: ignore[method-assign]
    said = iter([{"type": "websocket.connect"}, {"type": "websocket.receive", "text": '{"type": "learn"}'}])

    async def receive() -> Any:
        return next(said)

    async def send(message: Any) -> None:
        if message["type"] == "websocket.send":
            gone.set()
            raise OSError("the connection is lost")

    headers = [(b"host", b"127.0.0.1:8017"), (b"origin", b"http://127.0.0.1:8017")]
    scope = {"type": "websocket", "path": "/socket", "headers": headers, "query_string": b"", "subprotocols": []}
    asyncio.run(asyncio.wait_for(server.live_app(session)(scope, receive, send), 60.0))  # type: ignore[arg-type]
    assert obeyed == [{"type": "learn"}]
    session.close()


@pytest.mark.parametrize("debug", ["", "1"])
def test_what_fails_inside_a_request_is_one_line_unless_one_looks_for_it(
    debug: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("SWASHPLATE_DEBUG", debug)
    log = logging.getLogger("swashplate.tests.one-line")
    log.addFilter(connections.OneLine())
    try:
        raise ZeroDivisionError("100 % of it")
    except ZeroDivisionError:
        log.exception("Exception in ASGI application\n")
    log.error("Cancel %s running task(s), timeout graceful shutdown exceeded", 3)
    assert len(caplog.records) == 1
    assert ("Traceback" in caplog.text) == bool(debug)
    assert debug or "A request failed inside swash (ZeroDivisionError: 100 % of it). Please report it" in caplog.text


def test_a_name_of_this_machine_serves_others_only_when_asked_to() -> None:
    guard, open_guard = (Guard(None, remote=remote) for remote in (False, True))  # type: ignore[arg-type]
    assert not guard._ours("192.168.1.5:8017")
    assert open_guard._ours("192.168.1.5:8017")
    assert open_guard._ours(f"{socket.gethostname().lower()}:8017")
    assert not open_guard._ours("rebound.example:8017")


def test_listening_beyond_this_machine_must_be_meant() -> None:
    with pytest.raises(SwashError, match=r"can be reached from other machines.*allow_remote=true"):
        serving.listen("0.0.0.0", 0, allow_remote=False)
    made = serving.listen("0.0.0.0", 0, allow_remote=True)
    assert serving.address_of(made).startswith("http://127.0.0.1:")
    made.close()


def test_a_port_in_use_and_an_unknown_host_are_told() -> None:
    taken = serving.listen("127.0.0.1", 0, allow_remote=False)
    with pytest.raises(SwashError, match="--port 0 takes any free port"):
        serving.listen("127.0.0.1", taken.getsockname()[1], allow_remote=False)
    taken.close()
    with pytest.raises(SwashError, match="no address of this machine"):
        serving.listen("no such host", 0, allow_remote=False)


@pytest.mark.parametrize(
    "begin", [b"", b"GET / HTTP/1.1\r\nHost: ", b"POST / HTTP/1.1\r\nHost: {}\r\ncontent-length: 9\r\n\r\nx"]
)
def test_a_request_that_is_never_complete_ends_in_time(
    running: Running, monkeypatch: pytest.MonkeyPatch, begin: bytes
) -> None:
    monkeypatch.setattr(connections, "IN_TIME", 0.5)
    host, port = running.host.split(":")
    with socket.create_connection((host, int(port)), timeout=5.0) as half:
        half.sendall(begin.replace(b"{}", running.host.encode()))
        begun = time.monotonic()
        closed = False
        for _ in range(200):  # trickled bytes buy no time
            half.settimeout(0.1)
            try:
                while not closed:
                    closed = half.recv(4096) == b""
            except TimeoutError:
                if begin:
                    half.sendall(b"x")
            except ConnectionError:
                closed = True
            if closed:
                break
        assert closed
        assert 0.4 < time.monotonic() - begun < 10.0


def test_a_connection_that_has_asked_is_not_cut(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "IN_TIME", 0.3)
    with running.socket() as page, httpx.Client() as client:
        assert client.get(running.url).status_code == 200
        time.sleep(1.0)
        assert page.ping().wait(timeout=5.0)
        assert client.get(running.url).status_code == 200


def test_half_open_connections_neither_pile_up_nor_keep_a_page_out(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "MOST_WAITING", 8)
    host, port = running.host.split(":")
    half = [socket.create_connection((host, int(port)), timeout=5.0) for _ in range(40)]
    try:
        assert httpx.get(running.url).status_code == 200
        assert len(connections.Punctual._waiting) <= 8
        with contextlib.suppress(ConnectionError):
            assert half[0].recv(1) == b"", "the oldest is let go"
    finally:
        for each in half:
            each.close()


def test_a_frame_that_is_no_text_is_one_line_in_the_log(running: Running, caplog: pytest.LogCaptureFixture) -> None:

    with caplog.at_level(logging.WARNING, logger="uvicorn.error"):
        for _ in range(2):
            with running.socket() as page:
                page.recv(timeout=5.0)
                with page.send_context():
                    page.protocol.send_text(b"\xff\xfe{", fin=True)
                with pytest.raises(websockets.ConnectionClosed) as closed:
                    updates(page, lambda m: False)
                assert closed.value.rcvd is not None
                assert closed.value.rcvd.code == 1007
    told = [record for record in caplog.records if "UTF-8" in record.getMessage()]
    assert [record.getMessage() for record in told] == ["A page's message was refused: it is no UTF-8."]
    assert all(record.exc_info is None for record in caplog.records)


def test_a_library_that_was_changed_is_not_served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not (libraries.PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py")
    libraries.check_page()
    shutil.copytree(libraries.PAGE, tmp_path / "page")
    monkeypatch.setattr(libraries, "PAGE", tmp_path / "page")
    libraries.check_page()
    for name in libraries.LIBRARIES:
        file = tmp_path / "page" / "vendor" / name
        content = file.read_bytes()
        file.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
        with pytest.raises(SwashError, match=f"{name}: not the library that was pinned"):
            libraries.check_page()
        file.write_bytes(content)


def test_a_checkout_without_the_libraries_says_what_to_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "PAGE", tmp_path)
    with pytest.raises(SwashError, match=r"python scripts/vendor_page\.py"):
        libraries.check_page()


def test_an_interrupt_as_soon_as_the_address_is_told_ends_it() -> None:
    """One that came while the server was made was lost on a busy machine: nothing told of before it hears them."""
    told: list[str] = []

    def begun(address: str) -> None:
        told.append(address)
        signal.raise_signal(signal.SIGINT)

    with serving.listen("127.0.0.1", 0, allow_remote=False) as listening:
        serving.serve(Starlette(), listening, begun=begun)
    assert told[0].startswith("http://127.0.0.1:")
