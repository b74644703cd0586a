"""A question: what a field takes in Python, in a file of settings and as NAME=VALUE, and how it is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swashplate.api.languages import Band, Bands, Names, Values
from swashplate.api.question import (
    VerbQuestion,
    argument,
    entries,
    option,
    setting,
    settings_of,
)
from swashplate.api.saying import Say, silent
from swashplate.errors import SwashError


class Asking(VerbQuestion[dict[str, Any]]):
    """Ask something."""

    what: str = argument(metavar="WHAT", help="What is asked.")
    outputs: Names = option(default=(), help="Channels, separated by commas.")
    band: Band | None = option(default=None, help="Limits in Hz.")
    bands: Bands | None = option(default=None, help="Limits in Hz by pair.")
    fix: Values | None = option(default=None, help="Held parameters.")
    rate: float = option(default=100.0, help="Rate.", unit="Hz", least=1.0, most=2000.0)
    kind: str = option(default="lqg", help="Kind.", choices=("lqg", "lqr"))
    wild: bool = setting(default=False, help="rarely wanted")

    def answer(self, say: Say = silent) -> dict[str, Any]:
        say("asking")
        return {name: getattr(self, name) for name in entries(type(self))}


def ask(what: str, **given: Any) -> dict[str, Any]:
    return Asking(what, **given).answer()


def test_texts_lists_and_objects_mean_the_same() -> None:
    spelled = ask("x", outputs="p,q", band="0.1-10", fix=["mass=0.3"], rate="50")  # type: ignore[arg-type]
    plain = ask("x", outputs=("p", "q"), band=(0.1, 10.0), fix={"mass": 0.3}, rate=50.0)
    assert spelled == plain
    assert ask("x", outputs="mixer_roll")["outputs"] == ("mixer_roll",), "one name is no list of letters"
    assert ask("x", bands=["0.1-5", "p/lateral=1-2"])["bands"] == {"": (0.1, 5.0), "p/lateral": (1.0, 2.0)}


def test_a_file_and_pairs_say_what_the_line_leaves_out(tmp_path: Path) -> None:
    file = tmp_path / "settings.toml"
    file.write_text('rate = 50\nband = "0.1-10"\nwild = true\n[fix]\nmass = 0.3\n')
    assert settings_of([str(file)], Asking) == {"rate": 50, "band": (0.1, 10.0), "wild": True, "fix": {"mass": 0.3}}
    assert settings_of([str(file), "rate=20", "fix=a=1", "fix=b=2"], Asking)["rate"] == 20.0
    assert settings_of(["fix=a=1", "fix=b=2"], Asking) == {"fix": {"a": 1.0, "b": 2.0}}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rate": 0.5}, "rate: is 0.5, expected 1 to 2000 Hz"),
        ({"kind": "lqgg"}, "kind: 'lqgg' is unknown, expected one of lqg, lqr. Did you mean 'lqg'?"),
        ({"band": "10-1"}, "band: '10-1' is not LOW-HIGH in Hz"),
        ({"fix": ["mass"]}, "fix: 'mass' is not NAME=VALUE"),
        ({"fix": ["a=1", "a=2"]}, "fix: a is given twice"),
    ],
)
def test_what_cannot_be_is_refused_by_its_name(given: dict[str, Any], words: str) -> None:
    with pytest.raises(SwashError) as caught:
        ask("x", **given)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["rat=5"], "rat: is no setting of this verb. Did you mean 'rate'?"),
        (["rate=0.5"], "rate: is 0.5, expected 1 to 2000 Hz"),
        (["none.toml"], "there is no such file"),
    ],
)
def test_a_setting_that_cannot_be_is_refused(texts: list[str], words: str) -> None:
    with pytest.raises(SwashError) as caught:
        settings_of(texts, Asking)
    assert words in str(caught.value)


def test_the_class_has_the_fields_as_arguments() -> None:
    with pytest.raises(TypeError, match="wrong"):
        ask("x", wrong=1)
    with pytest.raises(TypeError, match="positional"):
        Asking("x", "p,q")  # type: ignore[misc]
    with pytest.raises(TypeError, match="what"):
        Asking()  # type: ignore[call-arg]


def test_what_is_done_is_said() -> None:
    said: list[str] = []
    Asking("x").answer(lambda what, **_: said.append(what))
    assert said == ["asking"]
