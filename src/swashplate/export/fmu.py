"""A model as a Functional Mock-up Unit: FMI 2.0 co-simulation, sources inside, a binary where a compiler is here."""

from __future__ import annotations

import hashlib
import io
import platform
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

from swashplate.atomic import scratch_folder
from swashplate.compiler import compiler, shared_library
from swashplate.engine.emit import fill_template
from swashplate.export.model_c import model_code
from swashplate.export.traced import Traced, Variable
from swashplate.flights.base_units import base_units


@dataclass(frozen=True)
class FmuVariable:
    """One real variable of the description; its place in the list is its value reference plus one."""

    name: str
    variable: Variable
    causality: str
    variability: str
    initial: str = ""
    derivative: int = 0


def entries(model: Traced, *, step: float) -> list[FmuVariable]:
    """Every variable in the order of the value references in `templates/fmu2.c`; `step` is the internal one [s]."""
    n = len(model.states)
    variables = [FmuVariable(v.name, v, "output", "continuous", "exact") for v in model.states]
    variables += [
        FmuVariable(f"der({v.name})", Variable(v.name, _per_second(v.unit)), "local", "continuous", "calculated", i + 1)
        for i, v in enumerate(model.states)
    ]
    taken = {v.name for v in model.states}
    for v in (*model.inputs, *model.surroundings):
        variables.append(FmuVariable(v.name, v, "input", "continuous"))
        taken.add(v.name)
    variables += [FmuVariable(f"parameters.{v.name}", v, "parameter", "tunable", "exact") for v in model.parameters]
    for v in model.outputs:
        name = f"{v.name}_measured" if v.name in taken else v.name
        variables.append(FmuVariable(name, v, "output", "continuous", "calculated"))
    longest = Variable("step_size", "s", step, meaning="longest internal step of the Runge-Kutta integration")
    variables.append(FmuVariable(longest.name, longest, "parameter", "tunable", "exact"))
    assert [e.derivative for e in variables[n : 2 * n]] == list(range(1, n + 1))
    return variables


def description(model: Traced, *, guid: str, version: str, sources: tuple[str, ...], step: float) -> bytes:
    """The XML document."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=_plain(model.name),
        guid=guid,
        description=_plain(" ".join([f"{model.title}. Starts at: {model.about}.", *model.origin])),
        generationTool=f"swashplate {version}",
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    unit = ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=model.name,
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    files = ElementTree.SubElement(unit, "SourceFiles")
    for name in sources:
        ElementTree.SubElement(files, "File", name=name)
    listed = entries(model, step=step)
    units = sorted({e.variable.unit for e in listed if e.variable.unit not in ("", "1")})
    if units:
        definitions = ElementTree.SubElement(root, "UnitDefinitions")
        for name in units:
            _unit(definitions, name)
    categories = ElementTree.SubElement(root, "LogCategories")
    ElementTree.SubElement(categories, "Category", name="logStatusError")
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stopTime="10", stepSize="0.01")
    variables = ElementTree.SubElement(root, "ModelVariables")
    for reference, entry in enumerate(listed):
        _variable(variables, reference, entry)
    structure = ElementTree.SubElement(root, "ModelStructure")
    groups = {
        "Outputs": [i for i, e in enumerate(listed) if e.causality == "output"],
        "Derivatives": [i for i, e in enumerate(listed) if e.derivative],
        "InitialUnknowns": [i for i, e in enumerate(listed) if e.initial == "calculated"],
    }
    for group, places in groups.items():
        element = ElementTree.SubElement(structure, group)
        for place in places:
            ElementTree.SubElement(element, "Unknown", index=str(place + 1))
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"


def _variable(parent: ElementTree.Element, reference: int, entry: FmuVariable) -> None:
    v = entry.variable
    element = ElementTree.SubElement(
        parent, "ScalarVariable", name=entry.name, valueReference=str(reference), causality=entry.causality
    )
    if v.meaning:
        element.set("description", _plain(v.meaning))
    element.set("variability", entry.variability)
    if entry.initial:
        element.set("initial", entry.initial)
    real = ElementTree.SubElement(element, "Real")
    if v.unit not in ("", "1"):
        real.set("unit", v.unit)
    if v.limits and entry.causality == "input":
        real.set("min", repr(float(v.limits[0])))
        real.set("max", repr(float(v.limits[1])))
    if entry.initial != "calculated":
        real.set("start", repr(float(v.start)))
    if entry.derivative:
        real.set("derivative", str(entry.derivative))


def _unit(parent: ElementTree.Element, name: str) -> None:
    element = ElementTree.SubElement(parent, "Unit", name=name)
    known = base_units(name)
    if known is not None:
        factor, powers = known
        scale = {} if factor == 1.0 else {"factor": repr(factor)}
        ElementTree.SubElement(element, "BaseUnit", {**{k: str(p) for k, p in sorted(powers.items())}, **scale})


def _per_second(unit: str) -> str:
    """The unit of a derivative."""
    if unit in ("", "1"):
        return "1/s" if unit else ""
    return {"m/s": "m/s^2", "rad/s": "rad/s^2"}.get(unit, f"{unit}/s")


def _plain(text: str) -> str:
    """Text without the characters that XML cannot hold."""
    return " ".join("".join(_xml_characters(text)).split())


def _xml_characters(text: str) -> Iterator[str]:
    for c in text:
        code = ord(c)
        yield c if code >= 0x20 and not 0xD800 <= code <= 0xDFFF and code not in (0xFFFE, 0xFFFF) else " "


_WRAPPER = "fmu2.c"
_CONFIG = "fmu_model.h"
STEP = 0.002
"""Longest internal Runge-Kutta step [s], unless a user sets `step_size`."""
_PAST = 256
_EPOCH = (1980, 1, 1, 0, 0, 0)


def fmu_platform() -> str | None:
    """FMI's name for this machine's binaries ("linux64"), None where FMI 2.0 has none."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return None
    return {"Linux": "linux64", "Darwin": "darwin64"}.get(platform.system())


def fmu(model: Traced, *, version: str) -> tuple[bytes, str]:
    """The .fmu as bytes, the same for the same model and compiler, and a message ("" where a binary is inside).

    Args:
        model: what to pack.
        version: of this package, for the description.

    Raises:
        ExportError: where the compiler refuses the sources.
    """
    code, step = model_code(model), internal_step(model)
    texts = {f"{model.name}.c": code.source, f"{model.name}.h": code.header, _WRAPPER: fill_template(_WRAPPER, {})}
    listed = (f"{model.name}.c", _WRAPPER)
    texts[_CONFIG] = _config(model, "", step)
    unsigned = description(model, guid="", version=version, sources=listed, step=step)
    digest = hashlib.sha256(b"\0".join([unsigned, *(texts[name].encode() for name in sorted(texts))])).hexdigest()
    guid = f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"
    texts[_CONFIG] = _config(model, guid, step)
    content = {
        "modelDescription.xml": description(model, guid=guid, version=version, sources=listed, step=step),
        **{f"sources/{name}": text.encode() for name, text in texts.items()},
    }
    message = ""
    place = fmu_platform()
    if place is None or compiler() is None:
        missing = "there is no C compiler (cc, gcc or clang)" if place else "FMI 2.0 has no name for this platform"
        message = f"{missing}: the FMU holds its sources and no binary; a tool that compiles FMUs can run it."
    else:
        content[
            f"binaries/{place}/{model.name}.so" if place == "linux64" else f"binaries/{place}/{model.name}.dylib"
        ] = _binary(texts, listed)
    return _packed(content), message


def internal_step(model: Traced) -> float:
    """Length of an internal Runge-Kutta step [s]: 2 ms, or half the fastest mode's time constant at the start."""
    rows = ([v.start for v in kind] for kind in (model.states, model.inputs, model.surroundings, model.parameters))
    A = np.asarray(model.jacobians.call([np.array(row) for row in rows])[0])
    fastest = float(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0))
    return min(STEP, 0.5 / fastest) if fastest > 0.0 else STEP


def _config(model: Traced, guid: str, step: float) -> str:
    delays = ""
    if model.delays:
        listed = ", ".join(repr(float(delay)) for delay in model.delays)
        delays = fill_template("fmu_delays.h", {"LONGEST": repr(max(model.delays)), "PAST": _PAST, "DELAYS": listed})
    names = fill_template("model_names.h", {"NAME": model.name})
    blanks = {"NAME": model.name, "NAMES": names, "STEP": repr(step), "GUID": guid, "DELAYS": delays}
    return fill_template(_CONFIG, blanks)


def _binary(texts: Mapping[str, str], sources: tuple[str, ...]) -> bytes:
    with scratch_folder() as here:
        for name, text in texts.items():
            (here / name).write_text(text, encoding="utf-8")
        # Hidden: two FMUs of one name in one process must not see each other's functions.
        library = shared_library([here / name for name in sources], here / "fmu.so", options=["-fvisibility=hidden"])
        return library.read_bytes()


def _packed(content: Mapping[str, bytes]) -> bytes:
    """A zip archive without the time of day."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(content):
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content[name])
    return buffer.getvalue()
