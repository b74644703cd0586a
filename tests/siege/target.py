"""A kind of file under siege, and how one of it is damaged: by bytes, by entries, or whole with odd numbers in it."""

from __future__ import annotations

import contextlib
import functools
import io
import json
import random
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import savemat

import made_logs
from mutations import mutated

from .damage import ODD_FLOATS, damaged

Use = Callable[[Path], object]


@dataclass(frozen=True)
class Target:
    """A kind of file: whole ones, how one is damaged (by its seed), and what reads it."""

    suffix: str
    whole: tuple[bytes, ...]
    mutate: Callable[[tuple[bytes, ...], random.Random], bytes]
    use: Use

    def mutant(self, chance: random.Random) -> bytes:
        """A damaged file; the same chance gives the same bytes."""
        return self.mutate(self.whole, chance)


def by_bytes(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
    return damaged(chance.choice(whole), chance, others=whole)


def by_entries(form: str) -> Callable[[tuple[bytes, ...], random.Random], bytes]:
    """Mostly a document with a wrong entry, now and then wrong bytes."""

    read = functools.cache(lambda text: tomllib.loads(text.decode()) if form == "toml" else json.loads(text))

    def mutate(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
        text = chance.choice(whole)
        if chance.random() < 0.5:
            return damaged(text, chance, others=whole)
        return mutated(read(text), chance, form=form).encode("utf-8", errors="surrogatepass")

    return mutate


def by_hdf5(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
    """Wrong bytes, or a file that the library wrote well with something in it that nobody would write."""
    content = chance.choice(whole)
    if chance.random() < 0.4:
        return damaged(content, chance, others=whole)
    file = io.BytesIO(content)
    with contextlib.suppress(Exception), h5py.File(file, "r+") as opened:
        _change_hdf5(opened, chance)
    return file.getvalue()


def _change_hdf5(opened: h5py.File, chance: random.Random) -> None:
    names: list[str] = []
    opened.visit(names.append)
    place = opened[chance.choice([*names, "/"])]
    values = np.array(chance.choices(ODD_FLOATS, k=chance.choice((0, 1, 2, 5, 40))))
    odd: Any = chance.choice((values, values.astype(np.float32), np.arange(3), "text", np.array([["a"]], "S3"), 7))
    match chance.randrange(5):
        case 0:
            place.attrs[chance.choice([*place.attrs, "units", "x"])] = odd
        case 1 if isinstance(place, h5py.Dataset) and place.size:
            for _ in range(chance.choice((1, 3, 50))):
                place[chance.randrange(place.shape[0])] = chance.choice(ODD_FLOATS)
        case 2 if place.name != "/":
            del opened[place.name]
        case 3 if place.name != "/":
            del opened[place.name]
            opened[place.name] = odd
        case _:
            key = chance.choice(list(opened.attrs))
            text = opened.attrs[key]
            document = json.loads(text) if isinstance(text, str) and text[:1] in "[{" else None
            opened.attrs[key] = mutated({"a": document}, chance, form="json")[5:-1] if document else odd


def by_matlab(whole: tuple[bytes, ...], chance: random.Random) -> bytes:
    """Wrong bytes, or a file with fields of odd numbers and shapes."""
    if chance.random() < 0.5:
        return by_bytes(whole, chance)
    fields = made_logs.coax_record(40)
    for _ in range(chance.choice((1, 1, 2, 3))):
        name = chance.choice([*fields, "other"])
        value = np.zeros(3) if name not in fields else fields[name]
        value = np.array(value if np.issubdtype(np.asarray(value).dtype, np.floating) else np.zeros(3))
        match chance.randrange(5):
            case 0:
                begin, step = chance.randrange(max(value.size, 1)), chance.choice((1, 7, 1000))
                value.flat[begin::step] = chance.choice(ODD_FLOATS)
            case 1:
                value = np.zeros(chance.choice(((0,), (0, 0), (1,), (3, 1), (2, 2, 2), (40, 3))))
            case 2:
                value = value * chance.choice(ODD_FLOATS)
            case 3:
                value = np.array("text")
            case _:
                value = value.T.astype(chance.choice(("f4", "i1", "u8", "c16")))
        fields[name] = value
    file = io.BytesIO()
    savemat(file, {"Data": fields}, do_compression=chance.random() < 0.5)
    return file.getvalue()
