"""The page of `swash open` as one HTML file with one log in it: curves, findings, fit, gains; no server, no network."""

from __future__ import annotations

import gzip
import html
import json
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from swashplate.arrays import Array
from swashplate.atomic import scratch_folder
from swashplate.errors import ExportError, SwashError
from swashplate.flights.flight import Flight
from swashplate.json_text import plain
from swashplate.links.logs.app import PAGE
from swashplate.links.logs.bins import trace
from swashplate.links.logs.code_lines import Read
from swashplate.links.logs.flight_review import review_of
from swashplate.links.logs.identify_sweep import identify_sweep
from swashplate.links.logs.map import map_of
from swashplate.links.logs.opened import Opened
from swashplate.links.logs.personal import KINDS, stripped
from swashplate.links.logs.spectra import spectra
from swashplate.links.logs.sweep_channels import channels_of
from swashplate.links.logs.track import track
from swashplate.links.web.single_file import single_file

LARGEST = 5_000_000
"""Bytes of a page."""
_RESERVE = 20_000  # bytes for what is said of the curves themselves
_SPECTRA = ("p", "q", "r", "ax", "ay", "az")
_MOST_SWEEPS = 4
"""Sweeps of one axis that are identified, each for itself."""
_FEWEST_BINS = 500
_TICK = 1e-6  # s


class SentPage(NamedTuple):
    """The page, and what the command says of it: what is in it, what was thinned, what was left out, and its names."""

    text: str
    remarks: tuple[str, ...]


class _Curves(NamedTuple):
    """Curves as bytes, how each lies in them, and which were thinned, in words."""

    content: bytes
    listed: list[dict[str, Any]]
    thinned: str

    @property
    def size(self) -> int:
        """Bytes of a page that they take."""
        return 4 * len(gzip.compress(self.content, 6)) // 3 + len(json.dumps(self.listed))


def sent_page(
    flight: Flight,
    path: Path,
    *,
    read: Read | None = None,
    keep: Collection[str] = (),
    maker: str = "",
    say: Callable[[str], None] = lambda _: None,
) -> SentPage:
    """A log as a page that is sent to others.

    Args:
        flight: as it was read from `path`.
        read: how; its words stand beside what can be done again.
        keep: what of `personal.KINDS` stays in it.
        maker: what made it, in a line.
        say: hears what is being done.

    Raises:
        SwashError: a kind that is none; a log that cannot be checked; one whose curves fit into no such page.
    """
    unknown = sorted(set(keep) - set(KINDS))
    if unknown:
        listed = "; ".join(f"{kind}: {what}" for kind, what in KINDS.items())
        raise ExportError(f"is {', '.join(unknown)}.", channel="keep", hint=f"There are {listed}.")
    bare, called, left_out, named = stripped(flight, path, keep=keep)
    if not bare.channels:
        raise ExportError(
            "has no channel left without what is personal.", where=path, hint="Ask for some of it: keep=place,others."
        )
    read = Read(called) if read is None else read.called(called)
    say("looking for what is wrong with the log")
    log = Opened.of(bare, read, path)
    listed = log.to_document()
    for problem in listed["problems"]:
        problem["remedy"] = None
    listed.update(table=False, foreign=False, listed=True)
    say("reviewing the flight")
    kept: dict[str, Any] = {
        "logs": [listed],
        "review": _kept(lambda: review_of(log)),
        "track": _kept(lambda: track(log)),
    }
    kept["map"] = _kept(lambda: map_of(log)) if "place" in keep else {"problem": "The place was left out of this page."}
    kept["spectra"] = {name: _kept(lambda name=name: _spectra(log, name)) for name in _SPECTRA if name in bare}
    kept["jobs"] = _jobs(log, say)
    say("thinning the curves")
    inside = _inside(log, kept, keep)
    gone = f"Left out: {'; '.join([*left_out, 'fields of messages that are no channels'])}."
    packed = json.dumps(plain(kept), separators=(",", ":")).encode()

    def page(curves: _Curves) -> SentPage:
        remarks = tuple(filter(None, (inside, curves.thinned, gone)))
        about = "".join(f"<p>{html.escape(line)}</p>" for line in (*remarks, maker))
        details = f'<details id="sent"><summary>A flight log, sent as a page: what is in it</summary>{about}</details>'
        text = single_file(
            PAGE / "open.html",
            entry="/open/sent.js",
            title=f"{called}: flight log",
            documents={"drawn": curves.listed},
            packed={"kept": packed, "curves": curves.content},
            folders={"/open/": PAGE},
            instead={"/open/server.js": "/open/kept.js"},
            within={
                '<body data-view="plots">': '<body data-view="plots" data-sent>',
                '<nav id="views"': f'{details}\n<nav id="views"',
            },
        )
        return SentPage(text, (*remarks, f"These channels and parameters: {', '.join(named)}.") if named else remarks)

    room = LARGEST - len(page(_Curves(b"", [], "")).text.encode()) - _RESERVE
    bins = -(-max(log.shown(name).time.size for name in bare.channels) // 2)
    while (size := (curves := _curves(log, bins)).size) > room:
        bins = min(bins - 1, int(bins * max(0.25, 0.95 * room / size)))
        if bins < _FEWEST_BINS:
            raise ExportError(
                f"does not fit into {LARGEST / 1e6:.3g} MB, not even with {_FEWEST_BINS} bins a channel.",
                where=path,
                hint="Send a part of it: FILE@START-STOP, in seconds.",
            )
    return page(curves)


def _kept(ask: Callable[[], Any]) -> dict[str, Any]:
    """An answer as the server of `swash open` gives it, or why there is none."""
    try:
        return {"answer": ask()}
    except SwashError as error:
        return {"problem": f"{f'{error.channel}: ' if error.channel else ''}{error.problem}", "hint": error.hint or ""}


def _spectra(log: Opened, name: str) -> dict[str, Any]:
    spectrum = spectra(log, name, log.ready.start, log.ready.stop)
    spectrum["frequency"], spectrum["density"] = (
        [float(f"{v:.6g}") for v in spectrum[key]] for key in ("frequency", "density")
    )
    return {**spectrum, "words": f"Of the whole log. {spectrum['words']}"}


def _jobs(log: Opened, say: Callable[[str], None]) -> dict[str, Any]:
    """What an identification of each sweep ends with, by the sweep's number."""
    assert log.inspection is not None
    sweeps = log.inspection.sweeps
    together = len({sweep.axis for sweep in sweeps}) > 1
    jobs: dict[str, Any] = {}
    for number, sweep in enumerate(sweeps[: 1 if together else _MOST_SWEEPS]):
        say(f"identifying sweep {number + 1}")
        try:
            chosen = channels_of(log.ready, sweep)
            with scratch_folder() as folder:
                identified = identify_sweep(
                    log, sweep, chosen, others=(), folder=folder, tell=lambda doing, share: None
                )
            job = {"state": "done", "result": {**identified.document, "files": []}, "channels": chosen._asdict()}
        except SwashError as error:
            job = {"state": "failed", "problem": error.problem, "hint": error.hint or "", "channels": {}}
        jobs[str(number)] = job
    return jobs


def _inside(log: Opened, kept: dict[str, Any], keep: Collection[str]) -> str:
    flight = log.ready
    origin = flight.provenance
    events = len([event for event in origin.events if event.kind != "parameter"])
    spectra_of = [name for name, one in kept["spectra"].items() if "answer" in one]
    done = [job["result"] for job in kept["jobs"].values() if job["state"] == "done"]
    fits = [f"{axis['output']} / {axis['input']}" for one in done for axis in one["axes"]]
    gains = [loop["axis"] for one in done for axis in one["axes"] for loop in axis["gains"]]
    parts = [
        f"{len(flight.channels)} channels of {flight.duration:.1f} s",
        f"{len(origin.parameters)} parameters" if origin.parameters else "",
        f"{events} events" if events else "",
        "findings and review",
        f"spectra of {', '.join(spectra_of)} over the whole log" if spectra_of else "",
        f"the fit of {', '.join(fits)}" if fits else "no fit",
        f"gains of {', '.join(gains)}" if gains else "no gains",
        *(f"{kind}: {KINDS[kind]}" for kind in KINDS if kind in keep),
    ]
    more = len(log.inspection.sweeps) - _MOST_SWEEPS if log.inspection else 0
    rest = f" {more} further sweeps are not fitted." if more > 0 and len(kept["jobs"]) == _MOST_SWEEPS else ""
    return f"Inside: {'; '.join(filter(None, parts))}.{rest}"


def _curves(log: Opened, bins: int) -> _Curves:
    """Every channel, of at most so many bins, as bytes: stamps [us] of 32 bits, values of 32 bits."""
    pieces: list[bytes] = []
    clocks: dict[bytes, int] = {}
    listed, thinned, samples, left = [], [], 0, 0
    size = 0

    def put(numbers: Array) -> int:
        nonlocal size
        # Bytes of one rank lie together: they are alike, and pack better.
        piece = np.ascontiguousarray(numbers).view(np.uint8).reshape(numbers.size, 4).T.tobytes()
        pieces.append(piece)
        size += len(piece)
        return size - len(piece)

    for name in log.ready.channels:
        shown = log.shown(name)
        drawn = trace(shown.time, shown.numbers, start=-np.inf, stop=np.inf, bins=bins, breaks=shown.breaks)
        samples, left = samples + shown.time.size, left + drawn.time.size
        thinned += [name] if drawn.thinned else []
        ticks = np.round((drawn.time - drawn.time[0]) / _TICK).astype(np.int64)
        steps = np.diff(ticks, prepend=0)
        unit = _TICK
        if steps.size and steps.max() >= 1 << 31:  # a pause of half an hour
            unit = 1e3 * _TICK
            steps = np.diff(np.round((drawn.time - drawn.time[0]) / unit).astype(np.int64), prepend=0)
        stamps = steps.astype("<i4")
        clock = stamps.tobytes()
        if clock not in clocks:
            clocks[clock] = put(stamps)
        listed.append(
            {
                "channel": name,
                "unit": shown.unit,
                "count": int(drawn.time.size),
                "begin": float(drawn.time[0]),
                "tick": unit,
                "time": clocks[clock],
                "values": put(drawn.values.astype("<f4")),
                "thinned": drawn.thinned,
            }
        )
    remark = ""
    if thinned:
        share = f"{left:,} of {samples:,} samples stay"
        remark = f"Thinned to the lowest and the highest of {bins:,} bins a channel: {', '.join(thinned)} ({share})."
    return _Curves(b"".join(pieces), listed, remark)
