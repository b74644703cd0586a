"""What hostile pages, other machines and broken browsers can send to the servers: refused, and others are served."""

from __future__ import annotations

import base64
import contextlib
import os
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from .found import Found, progress

HALF_OPEN = 1000
_ORIGINS = (
    "http://evil.example",
    "null",
    "file://",
    "https://HOST",
    "http://HOST.evil.example",
    "http://localhost:1",
    "",
)
_HOSTS = (
    "evil.example",
    "127.0.0.1.evil.example",
    "",
    "HOST@evil.example",
    "[::1",
    "0.0.0.0:80",
    "localhost.evil:1",
    "a b",
)
_PATHS = (
    "/../../etc/passwd", "/page/../../../pyproject.toml", "/page/%2e%2e/%2e%2e/server.py", "/page/..%2f..%2fserver.py",
    "/page//etc/passwd", "/page/%00", "/open/../app.py", "/download/../../etc/passwd", "/download/%2e%2e%2fetc",
    "/reports/../../x", "/recording/-1", "/recording/99999999999999999999", "/page/vendor/../../server.py",
    "/" + "a" * 20_000, "/page/" + "../" * 500 + "etc/passwd", "*", "http://evil.example/", "/\udce9".encode(
        "utf-8", "surrogateescape"
    ).decode("latin-1"),
)  # fmt: skip
_REQUESTS = (
    b"\x00" * 100, b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"GET / HTTP/9.9\r\n\r\n", b"GET\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: HOST\r\nHost: evil.example\r\n\r\n", b"A" * 200_000,
    b"GET / HTTP/1.1\r\nHost: HOST\r\n" + b"X: y\r\n" * 20_000 + b"\r\n",
    b"POST /upload HTTP/1.1\r\nHost: HOST\r\nOrigin: http://HOST\r\nContent-Length: -5\r\n\r\n",
    b"POST /upload HTTP/1.1\r\nHost: HOST\r\nOrigin: http://HOST\r\nContent-Length: 99999999999999\r\n\r\n{}",
    b"POST /upload HTTP/1.1\r\nHost: HOST\r\nOrigin: http://HOST\r\nTransfer-Encoding: chunked\r\n\r\nFFFFFFFFFFFF\r\n",
    b"POST /upload HTTP/1.1\r\nHost: HOST\r\nContent-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n",
    b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"CONNECT evil.example:443 HTTP/1.1\r\nHost: HOST\r\n\r\n",
    b"TRACE / HTTP/1.1\r\nHost: HOST\r\nOrigin: http://HOST\r\n\r\n", b"DELETE / HTTP/1.1\r\nHost: HOST\r\n\r\n",
)  # fmt: skip
_BODIES = (
    b"", b"{}", b"[]", b"null", b"{" * 5000, b'{"a":' * 20_000, b'{"name": "x", "size": -1}', b"\xff\xfe",
    b'{"name": "../../x", "size": 99999999999999999999}', b'{"name": "x", "size": 1e999}', b'{"log": 1, "log": 2}',
    b'{"name": "' + b"a" * 100_000 + b'", "size": 1}', b'{"name": null, "size": true}', b"9" * 60_000,
)  # fmt: skip
_ADDRESSES = ("/upload", "/upload/x/0", "/close", "/apply", "/traces", "/plot-code", "/spectra", "/track", "/align")
_ADDRESSES += ("/identify", "/cancel", "/common")
_FRAMES = (
    (1, b"x" * 200_000), (1, b"\xff\xfe\xfd"), (2, b"\x00" * 100), (1, b"{" * 2000), (1, b'{"type": "stick"}'),
    (3, b"x"), (15, b""), (9, b"x" * 200), (1, b'{"type": "pause", "value": 1}'), (1, b"[" * 2000), (0, b"of nothing"),
    (8, b"\x00"), (1, b'{"type": "wind", "north": 1e999, "east": 0, "down": 0}'), (1, b""),
)  # fmt: skip


@contextlib.contextmanager
def _served(words: list[str], folder: Path) -> Iterator[tuple[str, int, subprocess.Popen[bytes]]]:
    """A command that serves a page, and where."""
    said = folder / f"{words[0]}.txt"
    with said.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, "-m", "swashplate", *words],
            cwd=folder,
            stdout=out,
            stderr=subprocess.STDOUT,
            env=os.environ,
        )
    try:
        until = time.monotonic() + 180.0
        while not (found := re.search(r"http://(127\.0\.0\.1):(\d+)/", said.read_text(errors="replace"))):
            if time.monotonic() > until or process.poll() is not None:
                raise RuntimeError(f"swash {' '.join(words)} does not serve: {said.read_text(errors='replace')[-500:]}")
            time.sleep(0.2)
        yield found[1], int(found[2]), process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=20.0)
        except subprocess.TimeoutExpired:
            process.kill()


def _asked(host: str, port: int, data: bytes, *, wait: float = 3.0, most: int = 1 << 16) -> bytes:
    """What a server answers to bytes; what it closes is an answer too."""
    answer = b""
    with contextlib.suppress(OSError), socket.create_connection((host, port), timeout=wait) as line:
        line.settimeout(wait)
        with contextlib.suppress(OSError):
            line.sendall(data)
        while len(answer) < most and (got := line.recv(65_536)):
            answer += got
            head, end, body = answer.partition(b"\r\n\r\n")
            length = re.search(rb"content-length: (\d+)", head.lower())
            if end and (length is None or len(body) >= int(length[1])):
                break
    return answer


def _status(answer: bytes) -> int:
    found = re.match(rb"HTTP/1\.[01] (\d{3})", answer)
    return int(found[1]) if found else 0


def _request(method: str, path: str, *, host: str, origin: str | None = None, body: bytes = b"") -> bytes:
    lines = [f"{method} {path} HTTP/1.1", f"Host: {host}", "Connection: close"]
    lines += [] if origin is None else [f"Origin: {origin}"]
    lines += [f"Content-Length: {len(body)}"] if body or method == "POST" else []
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1", "replace") + body


def _upgrade(host: str, origin: str | None) -> bytes:
    key = base64.b64encode(bytes(16)).decode()
    lines = ["GET /socket HTTP/1.1", f"Host: {host}", "Upgrade: websocket", "Connection: Upgrade"]
    lines += [f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
    lines += [] if origin is None else [f"Origin: {origin}"]
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1", "replace")


def _frame(opcode: int, content: bytes) -> bytes:
    size = len(content)
    head = bytes([0x80 | opcode])
    head += bytes([0x80 | size]) if size < 126 else bytes([0x80 | 127]) + struct.pack(">Q", size)
    return head + bytes(4) + content


class _Server:
    """One server under siege: counts attacks, and keeps what is wrong."""

    def __init__(self, name: str, host: str, port: int, process: subprocess.Popen[bytes]) -> None:
        self.name, self.host, self.port, self._process = name, host, port, process
        self.ours = f"{host}:{port}"
        self.counts: dict[str, int] = {}
        self.bad: list[str] = []

    def judge(self, kind: str, what: str, problem: str) -> None:
        self.counts[kind] = self.counts.get(kind, 0) + 1
        if not problem and self._process.poll() is not None:
            problem = f"the server ended with {self._process.poll()}"
        if problem:
            self.bad.append(f"{self.name}, {kind}, {what[:80]!r}: {problem}")
        progress(f"{self.name}: {sum(self.counts.values())} attacks, {len(self.bad)} bad")

    def alive(self) -> str:
        """ "" where a page that is allowed to ask is answered."""
        for _ in range(3):
            if _status(_asked(self.host, self.port, _request("GET", "/", host=self.ours), wait=10.0)) == 200:
                return ""
        return "its own page is not answered any more"

    def told(self, text: str) -> str:
        return text.replace("HOST", self.ours)

    def attacked(self, *, sockets: bool, half_open: int, every: int) -> None:
        ask = lambda data: _asked(self.host, self.port, data)  # noqa: E731
        for origin in map(self.told, _ORIGINS[::every]):
            for method, path in (("GET", "/"), ("POST", "/upload")):
                got = _status(
                    ask(_request(method, path, host=self.ours, origin=origin, body=b"{}" * (method == "POST")))
                )
                self.judge("foreign origins", f"{method} {origin}", "" if got in (400, 403) else f"answered {got}")
            if sockets:
                got = _status(ask(_upgrade(self.ours, origin)))
                self.judge("foreign origins", f"socket {origin}", "" if got != 101 else "let in")
        for host in map(self.told, _HOSTS):
            got = _status(ask(_request("GET", "/", host=host)))
            self.judge("foreign hosts", host, "" if got in (0, 400, 403) else f"answered {got}")
        for path in _PATHS[::every]:
            answer = ask(_request("GET", path, host=self.ours))
            leaked = b"root:" in answer or b"import " in answer or b"[project]" in answer
            wrong = (
                leaked or _status(answer) in (101, 500) or (_status(answer) == 200 and b"<html" not in answer.lower())
            )
            self.judge("paths", path, f"answered {_status(answer)}" if wrong else "")
        for request in _REQUESTS[::every]:
            got = _status(ask(request.replace(b"HOST", self.ours.encode())))
            self.judge("broken requests", repr(request[:60]), f"answered {got}" if got in (101, 500) else "")
        for address in _ADDRESSES[::every]:
            for body in _BODIES[::every]:
                data = _request("POST", address, host=self.ours, origin=f"http://{self.ours}", body=body)
                got = _status(ask(data))
                self.judge("bodies", f"{address} {body[:30]!r}", f"answered {got}" if got >= 500 else "")
        self.judge("between", "", self.alive())
        for frame in _FRAMES if sockets else ():
            self.judge("frames", repr(frame)[:60], self._framed(*frame))
        self.judge("between", "", self.alive())
        self._half_open(half_open)

    def _framed(self, opcode: int, content: bytes) -> str:
        """Twenty-five times one frame on a socket: it is let go or goes on, and others are served."""
        with contextlib.suppress(OSError), socket.create_connection((self.host, self.port), timeout=3.0) as line:
            line.sendall(_upgrade(self.ours, f"http://{self.ours}"))
            line.recv(4096)
            for _ in range(25):
                line.sendall(_frame(opcode, content))
                while select.select([line], [], [], 0.0)[0] and line.recv(65_536):
                    pass
        return self.alive()

    def _half_open(self, count: int) -> None:
        """Connections that never ask: the page is answered beside all of them."""
        lines = []
        try:
            for k in range(count):
                with contextlib.suppress(OSError):
                    line = socket.create_connection((self.host, self.port), timeout=3.0)
                    lines.append(line)
                    line.sendall(b"GET / HTTP/1.1\r\nHost: " if k % 2 else b"")
                if k % 100 == 99:
                    self.judge("half-open connections", str(k), self.alive())
            self.counts["half-open connections"] = len(lines)
            self.judge("between", "", self.alive() or ("" if len(lines) == count else f"only {len(lines)} were taken"))
        finally:
            for line in lines:
                line.close()


def besiege(*, half_open: int = HALF_OPEN, live: bool = True, every: int = 1) -> Found:
    """The attack list, or every so manieth of it, on `swash open` and `swash live`."""
    rows, bad = [], []
    servers = {"swash open": ["open", "log.csv", "--port", "0"]}
    if live:
        servers["swash live"] = ["live", "coax", "--port", "0"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        table = "\n".join(f"{0.02 * k:.2f},{k % 7},{k % 5}" for k in range(200))
        (folder / "log.csv").write_text("time [s],p [rad/s],q [rad/s]\n" + table + "\n")
        for server, words in servers.items():
            with _served(words, folder) as (host, port, process):
                under = _Server(server, host, port, process)
                under.attacked(sockets=server == "swash live", half_open=half_open, every=every)
                said = (folder / f"{words[0]}.txt").read_text(errors="replace")
                if "Traceback" in said or len(said) > 20_000:
                    under.bad.append(f"{server}: says {len(said)} characters, {said[said.find('Traceback') :][:300]!r}")
                wrong = {kind: sum(f", {kind}, " in line for line in under.bad) for kind in under.counts}
                rows += [
                    [server, kind, count, wrong[kind]] for kind, count in under.counts.items() if kind != "between"
                ]
                bad += under.bad
    text = (
        f"{sum(row[2] for row in rows):,} attacks on servers that ran as commands: requests of other sites' pages and "
        "names, paths that climb out, requests and bodies that are none, frames that are oversized, no text or no "
        "frames, and connections that never ask. The page itself has to be answered between and after them, without a "
        "traceback."
    )
    return Found("Siege: hostile pages", text, ["server", "kind", "attacks", "wrong"], rows, bad)
