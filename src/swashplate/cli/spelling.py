"""One grammar for all verbs: the vehicle is an argument or `--vehicle`, everywhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import typer

_VEHICLE = "--vehicle"


def spelled(command: Any, given: Sequence[str]) -> list[str]:
    """The words after a verb in the way in which the verb declares them.

    Args:
        command: of click; of a group its own verb is looked for.
        given: what was typed after its name.
    """
    spelt = list(given)
    verbs = getattr(command, "commands", None)
    if verbs is not None:
        return [spelt[0], *spelled(verbs[spelt[0]], spelt[1:])] if spelt and spelt[0] in verbs else spelt
    options = {name for parameter in command.params for name in parameter.opts if name.startswith("-")}
    named = _VEHICLE in options
    _refuse_repeated(command, spelt)
    arguments = [parameter for parameter in command.params if parameter.param_type_name == "argument"]
    takes_place = bool(arguments) and arguments[0].name in ("vehicle", "model")
    if takes_place and not named:
        return _as_argument(spelt)
    if named and not arguments and spelt and not spelt[0].startswith("-"):
        return [_VEHICLE, *spelt]
    return spelt


def _refuse_repeated(command: Any, spelt: Sequence[str]) -> None:
    """An option that takes one value and is given twice: only the last would count, and nobody would be told.

    Raises:
        typer.BadParameter: naming it.
    """
    typed = [word.partition("=")[0] for word in spelt if word.startswith("-")]
    for parameter in command.params:
        if parameter.param_type_name != "option" or parameter.multiple or parameter.is_flag or parameter.count:
            continue
        if sum(name in parameter.opts for name in typed) > 1:
            lists = "by commas" in (parameter.help or "")
            hint = " Give its values once, by commas." if lists else " It takes one value."
            raise typer.BadParameter(f"is given more than once.{hint}", param_hint=parameter.opts[0])


def _as_argument(spelt: list[str]) -> list[str]:
    """`--vehicle NAME` in front, where the verb has its argument; the first one only."""
    for k, word in enumerate(spelt):
        if word == _VEHICLE and k + 1 < len(spelt):
            return [spelt[k + 1], *spelt[:k], *spelt[k + 2 :]]
        if word.startswith(f"{_VEHICLE}="):
            return [word.partition("=")[2], *spelt[:k], *spelt[k + 1 :]]
    return spelt
