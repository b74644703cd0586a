"""An interrupt that comes right behind the address, before the server listens for it, is the ordinary end."""

from __future__ import annotations

import pytest

from swashplate.api import open_logs
from swashplate.api.verbs.look import Open
from swashplate.links.web.libraries import PAGE


def _interrupted(address: str) -> None:
    assert address.startswith("http://127.0.0.1:")
    raise KeyboardInterrupt


@pytest.mark.skipif(
    not (PAGE / "vendor" / "three.module.min.js").is_file(),
    reason="the page's libraries are not here: python scripts/vendor_page.py",
)
def test_an_interrupt_behind_the_address_ends_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(open_logs, "ready", _interrupted)
    Open(port=0).answer()
