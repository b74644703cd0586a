"""modelDescription.xml of FMI 2.0 for a traced model (Functional Mock-up Interface 2.0.4, sec. 2.2 and 4.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree import ElementTree

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
    """Every variable in the order of the value references in runtime/fmu2.c; `step` is the internal one [s]."""
    n = len(model.states)
    made = [FmuVariable(v.name, v, "output", "continuous", "exact") for v in model.states]
    made += [
        FmuVariable(f"der({v.name})", Variable(v.name, _per_second(v.unit)), "local", "continuous", "calculated", i + 1)
        for i, v in enumerate(model.states)
    ]
    taken = {v.name for v in model.states}
    for v in (*model.inputs, *model.surroundings):
        made.append(FmuVariable(v.name, v, "input", "continuous"))
        taken.add(v.name)
    made += [FmuVariable(f"parameters.{v.name}", v, "parameter", "tunable", "exact") for v in model.parameters]
    for v in model.outputs:
        name = f"{v.name}_measured" if v.name in taken else v.name
        made.append(FmuVariable(name, v, "output", "continuous", "calculated"))
    longest = Variable("step_size", "s", step, meaning="longest internal step of the Runge-Kutta integration")
    made.append(FmuVariable(longest.name, longest, "parameter", "tunable", "exact"))
    assert [e.derivative for e in made[n : 2 * n]] == list(range(1, n + 1))
    return made


def description(model: Traced, *, guid: str, version: str, sources: tuple[str, ...], step: float) -> bytes:
    """The XML document."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=_plain(model.name),
        guid=guid,
        description=_plain(f"{model.title}. Starts at: {model.about}."),
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
