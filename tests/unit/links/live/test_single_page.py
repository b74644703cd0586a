"""The page that flies by itself: what lies in it, that nothing comes from elsewhere, and what is refused."""

from __future__ import annotations

import base64
import gzip
import json
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import swashplate as sp
from flown_here import World
from swashplate import compiler
from swashplate.api.verbs.export import ExportModel
from swashplate.errors import ExportError, MissingLibraryError, WriteError
from swashplate.links.live import frame_code
from swashplate.links.live.single_page import single_page
from swashplate.links.web.libraries import PAGE

NO_CODE = b"\0asm\1\0\0\0"
HOSTILE = "</script><script>alert(1)</script><b title='&\""


@pytest.fixture
def uncompiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """The page around a model that is not compiled."""
    if not (PAGE / "vendor" / "three.module.min.js").is_file():
        pytest.skip("the page's libraries are not here: python scripts/vendor_page.py (needs npm)")
    monkeypatch.setattr("swashplate.links.live.single_page.web_assembly", lambda source: NO_CODE)


def content(page: str, name: str) -> str:
    found = re.search(rf'<script type="[\w/]+" id="{name}">(.*?)</script>', page)
    assert found is not None
    return found[1]


@pytest.mark.usefixtures("uncompiled")
def test_all_of_it_lies_in_the_file_and_nothing_is_fetched() -> None:
    page = single_page(World(sp.vehicle("coax")), name="coax", origin=["card 1234"])
    assert len(page) < 1_000_000
    assert not re.search(r"(?:src|href)=\"(?!data:)", page)
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', page)
    assert policy is not None
    assert "default-src &#x27;none&#x27;" in policy[1]
    assert not re.search(
        r"unsafe-eval(?<!wasm-unsafe-eval)|https?:|connect-src|script-src[^;]*unsafe-inline", policy[1]
    )
    assert gzip.decompress(base64.b64decode(content(page, "flight"))) == NO_CODE
    modules = json.loads(gzip.decompress(base64.b64decode(content(page, "modules"))))
    there: set[str] = set()
    for name, text in modules:  # each after what it imports
        assert set(re.findall(r'from\s*"([./][^"]+)"', text)) <= there, name
        there.add(name)
    assert name == "/page/live.js", "last comes what begins"
    assert "/page/alone.js" in there
    assert "/page/connection.js" not in there
    assert "card 1234" in page


@pytest.mark.usefixtures("uncompiled")
def test_a_hostile_card_is_text() -> None:
    coax = sp.vehicle("coax")
    mass = replace(coax.card.parameters["mass"], source=HOSTILE)
    card = replace(coax.card, title=HOSTILE, parameters={**coax.card.parameters, "mass": mass})
    page = single_page(World(coax.with_card(card)), name="coax", origin=[HOSTILE])
    assert "alert(1)</script>" not in page
    assert "<b title" not in page
    assert json.loads(content(page, "model"))["hello"]["title"] == HOSTILE


def test_the_decision_as_a_graph_is_the_decision() -> None:
    """Of both kinds of pilot; the browser's test flies them."""
    pytest.importorskip("casadi", reason="the extra 'model' is not installed")
    random = np.random.default_rng(2)
    for name in ("coax", "raptor50"):
        world = World(sp.vehicle(name))
        pilot, told = world.pilot, len(world.vehicle.state_names) + 4
        graph = pilot.decide.graph(told, pilot.memory.size, pilot.gain_count)
        row, wanted = np.r_[world.trim.state, 0.0, 0.0, 0.0, 12.0], random.standard_normal(10)
        row = row + 0.01 * random.standard_normal(row.size)
        for (mode, _), gains in pilot.gains.items():
            after, commands = pilot.decide(np.array(pilot.memory), row, wanted, gains)
            found = np.asarray(graph.function(pilot.memory, row, wanted, gains))[:, 0]
            np.testing.assert_allclose(found, np.r_[after, commands], rtol=1e-12, atol=1e-12, err_msg=mode)


def test_what_is_no_vehicle_and_too_many_draws_are_refused() -> None:
    coax = sp.vehicle("coax")
    with pytest.raises(ExportError, match=r"draws: is 21, expected 20 at most"):
        sp.export_model(coax, "web", draws=[coax] * 21)
    with pytest.raises(ExportError, match="'c' holds no controller, no drawn models"):
        sp.export_model(coax, "c", draws=[coax])


def test_without_ziglang_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiler, "ziglang", lambda: None)
    monkeypatch.setattr(compiler.shutil, "which", lambda name: None)
    with pytest.raises(MissingLibraryError, match=r"a page in which a model flies needs .*swashplate\[compiler\]"):
        frame_code.web_assembly("int one(void) { return 1; }", exports=["one"])


@pytest.mark.skipif(find_spec("ziglang") is None, reason="the extra 'compiler' is not installed")
def test_a_module_imports_mathematics_alone_and_a_refusal_is_told(tmp_path: Path) -> None:
    made = frame_code.web_assembly("double one(double x); double one(double x) { return x * 2; }", exports=["one"])
    assert made[:4] == b"\0asm"
    assert b"\x03one" in made
    assert b"math" not in made
    sine = frame_code.web_assembly("#include <math.h>\ndouble one(double x) { return sin(x); }", exports=["one"])
    assert b"\x04math\x03sin" in sine, "what it lacks is the browser's"
    with pytest.raises(ExportError, match="ziglang refused the model's C"):
        frame_code.web_assembly("no C", exports=["one"])


def test_what_cannot_be_compiled_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not (PAGE / "vendor" / "three.module.min.js").is_file() or compiler.web_compiler() is None:
        pytest.skip("the page's libraries or what makes WebAssembly are not here")
    monkeypatch.setattr("swashplate.links.live.single_page.frame_code", lambda world: "no C")
    with pytest.raises(ExportError, match="refused the model's C"):
        ExportModel("coax", "web", out=tmp_path / "page.html").answer()
    assert list(tmp_path.iterdir()) == []


@contextmanager
def full_disk() -> Iterator[None]:
    """A limit on the size of files stands for it: what is written ends in the middle."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)


@pytest.mark.usefixtures("uncompiled")
def test_a_full_disk_leaves_no_half_of_a_page(tmp_path: Path) -> None:
    made = sp.export_model("coax", "web")
    with full_disk(), pytest.raises(WriteError, match=r"coax\.html"):
        made.save(tmp_path / "out")
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
    (file,) = made.save(tmp_path / "out")
    assert file.stat().st_size > 100_000


@pytest.mark.skipif(find_spec("ziglang") is None, reason="the extra 'compiler' is not installed")
def test_a_full_folder_for_temporary_files_is_named() -> None:
    source = "double one(double x) { return x; }" + "/* long */" * 12_000
    with full_disk(), pytest.raises(WriteError, match=r"frame\.c: cannot be written"):
        frame_code.web_assembly(source, exports=["one"])
