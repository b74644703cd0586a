"""Golden cases of exports: C of models and controllers, FMU, S-function, linear models for other programs."""

from __future__ import annotations

import hashlib
import re
import zipfile
from pathlib import Path

import numpy as np
from scipy import io

from . import extract
from .case import Values, case, named, thinned
from .extract import swash

NUMBER = re.compile(r"(?<![A-Za-z_0-9.])\d+\.?\d*(?:[eE][-+]?\d+)?")


def of_code(text: str) -> Values:
    """Code without comments: a hash of it with every number replaced, how many there are, and some of them."""
    bare = re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL)
    bare = re.sub(r"\s+", " ", bare)
    found = [float(number) for number in NUMBER.findall(bare)]
    shape = NUMBER.sub("#", bare)
    digest = hashlib.sha256(shape.encode()).hexdigest()
    decimals = [v for v in found if v != int(v)] if found else []
    return {
        "sha256 without numbers": digest,
        "numbers": float(len(found)),
        "sum": float(np.sum(np.abs(decimals))),
        "some": thinned(decimals, 40),
    }


def of_folder(folder: Path) -> Values:
    """Every file of an export."""
    found: Values = {}
    for path in sorted(folder.iterdir()):
        if path.suffix in (".c", ".h"):
            found |= named(path.name, of_code(path.read_text(encoding="utf-8")))
        elif path.suffix == ".json":
            found |= named(path.name, extract.of_json(document(path), most=60))
        elif path.suffix == ".mat":
            table = {k: v for k, v in io.loadmat(path, squeeze_me=True).items() if not k.startswith("__")}
            found |= named(path.name, of_mat(table))
        elif path.suffix == ".fmu":
            with zipfile.ZipFile(path) as archive:
                xml = archive.read("modelDescription.xml").decode()
                sources = sorted(n for n in archive.namelist() if n.startswith("sources/"))
                for name in sources:
                    found |= named(name, of_code(archive.read(name).decode()))
            found |= named("description", of_description(xml))
    return found


def document(path: Path) -> object:
    import json

    return json.loads(path.read_text(encoding="utf-8"))


def of_mat(table: dict[str, object]) -> Values:
    """Matrices of a .mat file, and of the structs in it."""
    found: Values = {}
    for name, value in sorted(table.items()):
        array = np.asarray(value)
        if array.dtype.names:
            inside = {key: array[key].item() if array[key].size == 1 else array[key] for key in array.dtype.names}
            found |= named(name, of_mat(inside))
        elif array.size and array.dtype.kind in "fiu":
            found[name] = thinned(array, 60)
    return found


def of_description(xml: str) -> Values:
    """Names, starts and units of an FMU's variables; its identifier and date are its own."""
    rows = re.findall(r'<ScalarVariable name="([^"]+)"[^>]*>\s*<Real([^>]*)>?', xml)
    starts = [float(m.group(1)) for _, real in rows if (m := re.search(r'start="([^"]+)"', real))]
    names = hashlib.sha256(" ".join(name for name, _ in rows).encode()).hexdigest()
    return {"variables": float(len(rows)), "sha256 of names": names, "starts": thinned(starts, 60)}


def exported(folder: Path, model: str, kind: str, *more: str) -> Values:
    """`swash export` into a folder."""
    out = folder / f"{Path(model).stem}-{kind}{len(more)}"
    swash("export", model, "--format", kind, *more, "--out", out, "-q")
    return of_folder(out)


@case(light=True, needs=["casadi"])
def c_of_the_coax(folder: Path) -> Values:
    return exported(folder, "coax", "c")


@case(needs=["casadi"])
def c_of_the_others(folder: Path) -> Values:
    """A helicopter in single precision and with speed, a state-space model, the S-function, the FMU."""
    found = named("raptor50", exported(folder, "raptor50", "c", "--speed", "5", "--precision", "float"))
    found |= named("lynx", exported(folder, "lynx", "c"))
    found |= named("thirteen", exported(folder, "thirteen_state", "c"))
    found |= named("simulink", exported(folder, "coax", "simulink"))
    return found | named("fmu", exported(folder, "coax", "fmu"))


@case()
def linear_exports(folder: Path) -> Values:
    """python-control and .mat, of a vehicle and of a state-space model."""
    found: Values = {}
    for kind in ("control", "matlab"):
        found |= named(f"raptor50.{kind}", exported(folder, "raptor50", kind, "--speed", "5"))
        found |= named(f"rotor_body.{kind}", exported(folder, "rotor_body", kind))
    return found


@case(needs=["casadi"])
def c_of_controllers(folder: Path) -> Values:
    """The decoupling autopilot and two observers with their gains as C."""
    swash("control", "decouple", "coax", "--mode", "place", "--out", folder / "place.c", "-q")
    sensors = ("--sensors", "imu@100,mocap@50+20ms", "-q")
    swash("control", "design", "coax", *sensors, "--gain", "steady", "--out", folder / "steady.c")
    swash("control", "design", "thirteen_state", "--sensors", "gyro@100,mocap@100", "--out", folder / "linear.c", "-q")
    return of_folder(folder)
