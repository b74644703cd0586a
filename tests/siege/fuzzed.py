"""The fuzzer's loop: one process feeds a container's parser in a child, and takes another child where that one ends.

    python -m tests.siege.fuzzed NAME SEED INPUTS SECONDS KEPT [AGAIN ...]

An input with a new outcome joins those that are changed next, and lies in the folder KEPT. An outcome is new by the
places of the code through which an error went, by what was read, and, at each 16th input, by the lines of Python that
were run (swashplate's and those of the readers' libraries in Python; what is compiled is not seen). Lines out are JSON:
what fell, or ended or held up its process, and at the end the counts.
"""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import random
import resource
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

from swashplate.errors import SwashError

from .containers import CONTAINERS, Container
from .damage import damaged
from .worker import LONGEST_MESSAGE

COUNTS = ("inputs", "read", "refused", "fell", "contained", "kept", "whole", "whole read", "whole refused")
"""What is counted; `contained`: a library ended its process or held it up, and the whole reader said so in words."""
SLOWEST = 10
"""s of the processor that an input may take; thirty times as long on the clock."""
MEMORY = 512 << 20
"""Bytes that the process may take on top of what it has before the first input (files of some kilobytes)."""
_HEAD = struct.Struct(f"<{len(COUNTS) + 2}Q")  # and stage and size of the input, which lies behind them
_ROOM = 1 << 20  # bytes of an input at most
_TRACED, _WHOLE = 16, 256
_MOST = 600  # inputs that are kept
_MODULES = ("/swashplate/", "/rosbags/", "/pyulog/")
_PARSER, _READER = 1, 2
_FAULT = 70  # of the loop itself


class _Lines:
    """The lines of Python that were run, each told once."""

    def __init__(self) -> None:
        self._seen: set[tuple[Any, int]] = set()
        self._ours: dict[Any, bool] = {}
        self.new = False

    def call(self, frame: FrameType, event: str, arg: object) -> Any:
        code = frame.f_code
        ours = self._ours.get(code)
        if ours is None:
            ours = self._ours[code] = any(part in code.co_filename for part in _MODULES)
        return self._line if ours else None

    def _line(self, frame: FrameType, event: str, arg: object) -> Any:
        at = (frame.f_code, frame.f_lineno)
        if at not in self._seen:
            self._seen.add(at)
            self.new = True
        return self._line


def places(error: BaseException | None) -> tuple[tuple[str, int], ...]:
    """Where the code was when an error was raised, and those before it that led to it."""
    found: list[tuple[str, int]] = []
    while error is not None and len(found) < 60:
        step = error.__traceback__
        while step is not None:
            found.append((step.tb_frame.f_code.co_name, step.tb_lineno))
            step = step.tb_next
        error = error.__cause__ or error.__context__
    return tuple(found[:60])


def parsed(container: Container, content: bytes, path: Path) -> tuple[str, object]:
    """The parser's outcome: "read", "refused" or "fell", and what tells it from others."""
    try:
        return "read", repr(container.take(content, path))
    except SwashError as error:
        return "refused", places(error)
    except Exception as error:
        if container.told(error):
            return "refused", (type(error).__name__, places(error))
        return "fell", f"{type(error).__name__}: {str(error)[:200]} at {places(error)[-1:]}"


def read_whole(container: Container, path: Path) -> tuple[str, str]:
    """The whole reader's outcome, and its words."""
    try:
        container.use(path)
    except SwashError as error:
        long = len(str(error)) > LONGEST_MESSAGE
        return ("fell", f"message of {len(str(error))} characters") if long else ("refused", str(error))
    except Exception as error:
        return "fell", f"{type(error).__name__}: {str(error)[:200]} at {places(error)[-1:]}"
    return "read", ""


def forked(work: Callable[[], int]) -> int:
    """The exit code of a child that does this: of its own, or minus the signal that ended it."""
    sys.stdout.flush()
    OUT.flush()
    child = os.fork()
    if child == 0:
        code = _FAULT
        try:
            code = work()
        except Exception:
            traceback.print_exc()
        finally:
            OUT.flush()
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


class Loop:
    """The counts and the last input, shared with the child that parses.

    Args:
        name: of the container.
        container: it.
        seed: other inputs.
        kept: folder of inputs with new outcomes.
        again: inputs that come first.
        folder: for the file that is read.
    """

    def __init__(
        self, name: str, container: Container, *, seed: int, kept: Path, folder: Path, again: Sequence[bytes] = ()
    ) -> None:
        self.name, self.container, self.kept, self.seed = name, container, kept, seed
        self.path, self.again = folder / f"a{container.suffix}", again
        self.counts = dict.fromkeys(COUNTS, 0)
        self.shared = mmap.mmap(-1, _HEAD.size + _ROOM)
        self.longest = 2 * max(map(len, container.whole)) + 2048

    def run(self, inputs: int, seconds: float) -> dict[str, int]:
        """As many inputs, or as the time allows."""
        until = time.monotonic() + seconds
        while self.counts["inputs"] < inputs and time.monotonic() < until:
            code = forked(lambda: self._child(inputs, until))
            *counts, stage, size = _HEAD.unpack_from(self.shared)
            self.counts = dict(zip(COUNTS, counts, strict=True))
            if code == 0:
                break
            if not stage or code == _FAULT:
                raise RuntimeError(f"{self.name}: the loop itself ended with {code}")
            self._judge(stage, bytes(self.shared[_HEAD.size : _HEAD.size + size]), code)
        return self.counts

    def _judge(self, stage: int, content: bytes, code: int) -> None:
        """An input that ended its process: within the process with limits it costs an error, elsewhere it is one."""
        hang = code in (-signal.SIGPROF, -signal.SIGALRM)
        words = f"took more than {SLOWEST} s" if hang else f"ended the process with {code}"
        contained = False
        if stage == _PARSER and self.container.job:
            self.path.write_bytes(content)

            def again() -> int:
                signal.alarm(30 * SLOWEST)
                return 0 if read_whole(self.container, self.path)[0] != "fell" else 1

            contained = forked(again) == 0
        self.counts["inputs"] += stage == _PARSER
        self.counts["contained" if contained else "fell"] += 1
        self._tell(content, ("contained: " if contained else "") + words)

    def _child(self, inputs: int, until: float) -> int:
        self.chance = random.Random(f"{self.name} {self.seed} {self.counts['inputs']}")
        self.lines, self.outcomes = _Lines(), set[int]()
        found = [path.read_bytes() for path in sorted(self.kept.glob("*"))[:_MOST]]
        self.inputs = [*self.container.whole, *found]
        for content in self.inputs:  # what was found before is new to nobody
            self._parse(content, traced=True)
        had = 0
        with suppress(OSError, IndexError, ValueError):
            had = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_DATA, (had + MEMORY, had + MEMORY))
        while self.counts["inputs"] < inputs:
            self._say(0, b"")  # what hangs here is the loop's own
            first = self.counts["inputs"] < len(self.again)
            self._step(self.again[self.counts["inputs"]] if first else self._changed())
            if self.counts["inputs"] % 64 == 0 and time.monotonic() > until:
                break
        self._say(0, b"")
        return 0

    def _changed(self) -> bytes:
        chance, forge = self.chance, self.container.forge
        if forge is not None and chance.random() < 0.5:
            with suppress(Exception):  # what was kept may no longer have records
                return forge((chance.choice(self.inputs),), chance)[:_ROOM]
        return damaged(chance.choice(self.inputs), chance, others=self.inputs)[:_ROOM]

    def _parse(self, content: bytes, *, traced: bool) -> tuple[str, object, bool]:
        """The outcome of an input, and whether it is a new one."""
        self.path.write_bytes(content)
        self.lines.new = False
        signal.setitimer(signal.ITIMER_PROF, SLOWEST)
        signal.alarm(30 * SLOWEST)
        if traced:
            sys.settrace(self.lines.call)
        end, sign = parsed(self.container, content, self.path)
        sys.settrace(None)
        outcome = hash((end, sign))
        new = self.lines.new or outcome not in self.outcomes
        self.outcomes.add(outcome)
        return end, sign, new

    def _step(self, content: bytes) -> None:
        counts = self.counts
        self._say(_PARSER, content)
        end, sign, new = self._parse(content, traced=counts["inputs"] % _TRACED == 0)
        counts["inputs"] += 1
        counts[end] += 1
        if end == "fell":
            self._tell(content, str(sign))
        if new and 0 < len(content) <= self.longest and len(self.inputs) < _MOST:
            counts["kept"] += 1
            self.inputs.append(content)
            (self.kept / hashlib.sha256(content).hexdigest()[:24]).write_bytes(content)
        if new or counts["inputs"] % _WHOLE == 0:
            self._say(_READER, content)
            end, words = read_whole(self.container, self.path)
            counts["whole"] += 1
            counts["fell" if end == "fell" else f"whole {end}"] += 1
            if end == "fell":
                self._tell(content, f"whole reader: {words}")

    def _say(self, stage: int, content: bytes) -> None:
        head = _HEAD.pack(*self.counts.values(), stage, len(content))
        self.shared[: len(head) + len(content)] = head + content

    def _tell(self, content: bytes, words: str) -> None:
        print(json.dumps({"words": words, "input": content.hex()}), file=OUT, flush=True)


OUT = sys.stdout


def main() -> None:
    name, seed, inputs, seconds, kept, *files = sys.argv[1:]
    again = [Path(file).read_bytes() for file in files]
    sys.stdout = sys.stderr  # what a library prints is no answer
    warnings.simplefilter("ignore")
    fast = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=fast if fast.is_dir() else None) as folder:
        loop = Loop(name, CONTAINERS[name](), seed=int(seed), kept=Path(kept), folder=Path(folder), again=again)
        print(json.dumps(loop.run(max(int(inputs), len(again)), float(seconds))), file=OUT)


if __name__ == "__main__":
    main()
