"""`swash`, also as `python -m swashplate`: an interrupt ends in words even while the verbs are still being loaded."""

from __future__ import annotations

import gc
import os
import sys
from typing import NoReturn

if __name__ == "__main__" and not sys.flags.safe_path:
    del sys.path[0]  # `python -m` puts the folder that it works in there: what lies in it must not be imported

from swashplate.threads import ONE_THREAD


def main() -> NoReturn:
    """The console script."""
    os.environ.update(ONE_THREAD)
    gc.set_threshold(50_000, 20, 20)  # cells of a large table are no cycles: looking for some took a fifth of reading
    try:
        from swashplate.cli.app import main as run

        run()
    except KeyboardInterrupt:  # while the verbs are loaded, or the command line is read
        print("Stopped. Nothing was left half-written.", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
