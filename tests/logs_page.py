"""A served page for logs, small logs to put on it, and a client that asks as the page does."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="the extra `live` is not installed")

import httpx
import uvicorn

from swashplate.links.logs.app import logs_app
from swashplate.links.logs.desk import Desk
from swashplate.links.web import serving


class Asking:
    """A served desk and a client of its page."""

    def __init__(self) -> None:
        self.desk = Desk()
        self.listening = serving.listen("127.0.0.1", 0, allow_remote=False)
        self.url = serving.address_of(self.listening)
        self.server = uvicorn.Server(serving.configured(logs_app(self.desk)))
        self.thread = threading.Thread(target=lambda: asyncio.run(self.server.serve(sockets=[self.listening])))
        self.thread.start()
        self.client = httpx.Client(base_url=self.url, headers={"origin": self.url.rstrip("/")}, timeout=60.0)

    def post(self, address: str, **fields: Any) -> Any:
        answer = self.client.post(address, json=fields)
        assert answer.status_code == 200, answer.text
        return answer.json()

    def refused(self, address: str, **fields: Any) -> tuple[int, str]:
        answer = self.client.post(address, json=fields)
        told = answer.json()
        assert "Traceback" not in answer.text
        return answer.status_code, told["problem"]

    def drop(self, name: str, content: bytes, *, piece: int = 1 << 20) -> int:
        """A file sent in pieces; its number."""
        token = self.post("/upload", name=name, size=len(content))["token"]
        made = {}
        for at in range(0, len(content), piece):
            answer = self.client.post(f"/upload/{token}/{at}", content=content[at : at + piece])
            assert answer.status_code == 200, answer.text
            made = answer.json()
        return int(made["log"])

    def log(self, number: int) -> dict[str, Any]:
        found: dict[str, Any] = next(log for log in self.client.get("/logs").json()["logs"] if log["id"] == number)
        return found

    def close(self) -> None:
        self.client.close()
        self.server.should_exit = True
        self.thread.join(timeout=10.0)
        self.desk.close()
        self.listening.close()


def table(path: Path, *, flip: bool = False, seed: int = 0, shift: float = 0.0, names: str = "phi theta p q") -> bytes:
    """A CSV of half a minute of rolling about, `flip` with the roll rate's sign turned."""
    time = np.arange(0.0, 30.0, 0.02) + shift
    chance = np.random.default_rng(seed)
    slow = np.convolve(chance.standard_normal(time.size), np.hanning(40), mode="same") * 0.01
    phi, theta = 0.2 * np.sin(4.0 * (time - shift)) + slow, 0.1 * np.cos(3.0 * (time - shift))
    p, q = np.gradient(phi, time), np.gradient(theta, time)
    columns = np.stack([time, phi, theta, -p if flip else p, q], axis=1)
    units = ("rad", "rad", "rad/s", "rad/s")
    head = ",".join(["time [s]", *(f"{n} [{u}]" for n, u in zip(names.split(), units, strict=True))])
    path.write_text(head + "\n" + "\n".join(",".join(map(repr, row)) for row in columns.tolist()) + "\n")
    return path.read_bytes()
