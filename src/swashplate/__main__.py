"""`swash`, also as `python -m swashplate`: an interrupt ends in words even while the verbs are still being loaded.

What is imported before `main` has set its handler is kept to a few milliseconds: an interrupt there, as in Python's own
start, is answered by Python.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import NoReturn

if __name__ == "__main__" and not sys.flags.safe_path:
    del sys.path[0]  # `python -m` puts the folder that it works in there: what lies in it must not be imported


def _leave(*_: object) -> None:
    """Nothing has been begun: there is nothing to clean up, and no import that could catch an exception and go on."""
    os.write(2, b"Stopped. Nothing was left half-written.\n")
    os._exit(130)


def main() -> NoReturn:
    """The console script."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # in a shell's background it is ignored
        signal.signal(signal.SIGINT, _leave)  # until the command line is read
    from swashplate.threads import ONE_THREAD

    os.environ.update(ONE_THREAD)
    if "PATH" in os.environ:  # libraries start programs by name: none is taken from the folder that we work in
        folders = os.environ["PATH"].split(os.pathsep)
        os.environ["PATH"] = os.pathsep.join(folder for folder in folders if os.path.isabs(folder))
    gc.set_threshold(50_000, 20, 20)  # cells of a large table are no cycles: looking for some took a fifth of reading
    atexit.register(gc.freeze)  # what is left at the end goes with the process: nobody looks for cycles in it
    from swashplate.cli.app import main as run

    run()


if __name__ == "__main__":
    main()
