"""The description of an FMU, ``modelDescription.xml`` of FMI 2.0, and its variables.

Source:
    Functional Mock-up Interface for Model Exchange and Co-Simulation 2.0, sections 2.2 and 4.3.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, field

from rom.units import BASES, unit


@dataclass(frozen=True, slots=True)
class Variable:
    """A real variable; its place in the list is its value reference."""

    name: str  # e.g. ``rod.b.position[1]``
    causality: str  # "parameter", "input" or "output"
    unit: str  # e.g. "m/s"
    start: float | None = None  # value at the start; None for outputs, which follow from the others
    description: str = ""  # one phrase


def structured(*parts: str) -> str:
    """A name of the structured naming convention: what is no identifier is put in quotes."""
    return ".".join(map(_identified, parts))


def _identified(part: str) -> str:
    if part.isascii() and part.isidentifier():
        return part
    kept = "".join(c if c.isascii() and c.isprintable() else "_" for c in part)
    for mark in ("\\", "'", '"'):
        kept = kept.replace(mark, "\\" + mark)
    return f"'{kept}'"


def components(
    name: str, causality: str, unit: str, starts: Iterable[float | None], description: str = ""
) -> list[Variable]:
    """The numbers of a vector, ``name[1]`` and so on, by their values at the start."""
    return [
        Variable(f"{name}[{k}]", causality, unit, x if x is None else float(x), description)
        for k, x in enumerate(starts, 1)
    ]


@dataclass(frozen=True)
class Content:
    """What goes into an FMU."""

    name: str  # of the model
    about: str  # one sentence on it
    variables: list[Variable]  # in the order of their value references
    step: float  # communication step for a start [s]
    core: str  # C file of the model behind the interface
    headers: tuple[str, ...] = ()  # C files that it includes
    data: str = ""  # C text of tables that the core includes as ``tables.h``
    # files by their names below ``resources/``
    resources: dict[str, bytes] = field(default_factory=dict)
    tool: bool = False  # whether it needs another program where it runs


def model_description(
    content: Content, guid: str = "", identifier: str = "", sources: tuple[str, ...] = ()
) -> bytes:
    """The XML text for this very FMU, the C name of its binary and its C files.

    Outputs do not follow inputs at once, which spares the caller algebraic loops.
    """
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=content.name,
        guid=guid,
        description=content.about,
        generationTool="rom",
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    flags = {
        "modelIdentifier": identifier,
        "needsExecutionTool": str(content.tool).lower(),
        "canHandleVariableCommunicationStepSize": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canNotUseMemoryManagementFunctions": "true",
    }
    files = ET.SubElement(ET.SubElement(root, "CoSimulation", flags), "SourceFiles")
    for name in sources:
        ET.SubElement(files, "File", name=name)
    units = ET.SubElement(root, "UnitDefinitions")
    for name in sorted({variable.unit for variable in content.variables}):
        bases = zip(BASES, unit(name.replace(".", " ")).dimension, strict=True)
        powers = sorted((pair for pair in bases if pair[1]), key=lambda pair: pair[1] < 0)
        base = {key: str(value) for key, value in powers}
        ET.SubElement(ET.SubElement(units, "Unit", name=name), "BaseUnit", base)
    categories = ET.SubElement(root, "LogCategories")
    for name in ("logStatusError", "logStatusWarning"):
        ET.SubElement(categories, "Category", name=name)
    ET.SubElement(root, "DefaultExperiment", startTime="0.0", stepSize=repr(content.step))
    listed = ET.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(content.variables):
        _variable(listed, reference, variable)
    _structure(root, content.variables)
    ET.indent(root)
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True)


def _variable(listed: ET.Element, reference: int, variable: Variable) -> None:
    kinds = {
        "parameter": {"variability": "fixed", "initial": "exact"},
        "input": {"variability": "continuous"},
        "output": {"variability": "continuous", "initial": "calculated"},
    }
    about = {"description": variable.description} if variable.description else {}
    scalar = ET.SubElement(
        listed,
        "ScalarVariable",
        {"name": variable.name, "valueReference": str(reference), **about},
        causality=variable.causality,
        **kinds[variable.causality],
    )
    start = {} if variable.start is None else {"start": repr(float(variable.start))}
    ET.SubElement(scalar, "Real", {"unit": variable.unit, **start})


def _structure(root: ET.Element, variables: list[Variable]) -> None:
    structure = ET.SubElement(root, "ModelStructure")
    output_indices = [str(k) for k, v in enumerate(variables, 1) if v.causality == "output"]
    if not output_indices:
        return
    outputs = ET.SubElement(structure, "Outputs")
    unknowns = ET.SubElement(structure, "InitialUnknowns")
    for index in output_indices:
        ET.SubElement(outputs, "Unknown", index=index, dependencies="")
        ET.SubElement(unknowns, "Unknown", index=index)
