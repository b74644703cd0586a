"""`sitecustomize` of every Python process of a command: what it opens to write, binds, loads and starts.

Python tells it (audit events), so that nothing is missed between two looks; processes that are started tell it, too.
"""

import json
import os
import sys

_TOLD = os.open(os.environ["SWASH_SEEN"], os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
_NAMES = {"os.mkdir", "os.symlink", "os.link", "os.mkfifo", "socket.bind", "socket.connect", "ctypes.dlopen"}


def _look(event: str, given: tuple) -> None:
    if event == "open":
        path, _, flags = given
        if not isinstance(path, str | bytes) or not isinstance(flags, int) or not flags & _WRITES:
            return
        told = [event, os.path.abspath(os.fsdecode(path)), bool(flags & os.O_EXCL)]
    elif event == "os.mkdir":
        told = [event, os.path.abspath(os.fsdecode(given[0])), given[1]]
    elif event in ("socket.bind", "socket.connect"):
        told = [event, repr(given[1]), given[0].family.name]
    elif event == "subprocess.Popen":
        told = [event, os.fsdecode(given[0]), ""]
    elif event in _NAMES:
        told = [event, str(given[0]), ""]
    else:
        return
    os.write(_TOLD, json.dumps(told).encode() + b"\n")


sys.addaudithook(_look)
