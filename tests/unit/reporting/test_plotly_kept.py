"""plotly.js lies compressed in the user's cache folder: read again as it was, made anew where it is damaged."""

from __future__ import annotations

import base64
import gzip
from pathlib import Path

import pytest

from swashplate import kept
from swashplate.reporting import packing


def test_a_damaged_or_missing_copy_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept.platformdirs, "user_cache_dir", lambda *_, **__: str(tmp_path))
    monkeypatch.setattr(packing, "library", lambda *_, **__: type("", (), {"get_plotlyjs": lambda: "let a = 1;"}))
    made = []
    squeezed = packing._squeezed
    monkeypatch.setattr(packing, "_squeezed", lambda content: made.append(content) or squeezed(content))
    asked = packing.plotly_script.__wrapped__
    text = asked()
    assert gzip.decompress(base64.b64decode(text)) == b"let a = 1;"
    assert asked() == text
    assert len(made) == 1, "the second time it was read"
    (copy,) = (tmp_path / "pages").iterdir()
    copy.write_text(copy.read_text().replace("H4s", "H4x"))
    assert asked() == text
    assert len(made) == 2, "what is damaged is not believed"
    monkeypatch.setattr(kept.platformdirs, "user_cache_dir", lambda *_, **__: str(copy))  # no folder
    assert asked() == text
