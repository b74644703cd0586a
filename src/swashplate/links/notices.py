"""What a link tells its user: each kind of event once, the others counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

Say = Callable[[str], None]


class Notices:
    """One line a kind.

    Args:
        say: where lines go.
    """

    def __init__(self, say: Say) -> None:
        self._say = say
        self.counts: Counter[str] = Counter()

    def tell(self, kind: str, text: str) -> None:
        """Say `text` if nothing of this kind was said before; count it in any case."""
        self.counts[kind] += 1
        if self.counts[kind] == 1:
            self._say(text)

    def always(self, text: str) -> None:
        """Say what happens rarely and matters every time (a start, a restart, a crash)."""
        self._say(text)

    def summary(self) -> str:
        """The counts in one line, empty where there are none."""
        return ", ".join(f"{kind}: {count}" for kind, count in sorted(self.counts.items()))
