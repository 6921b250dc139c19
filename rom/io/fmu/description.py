"""The description of an FMU, ``modelDescription.xml`` of FMI 2.0.

Source:
    Functional Mock-up Interface for Model Exchange and Co-Simulation 2.0, sections 2.2 and 4.3.
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass

from rom.io.fmu.variables import Variable

# exponents of kg, m, s, rad
UNITS = {
    "1": {},
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
}


@dataclass(frozen=True, slots=True)
class Model:
    """What an FMU is apart from its variables.

    Attributes:
        name: of the model.
        identifier: of its binary, a C name.
        guid: of this very FMU.
        tool: whether it needs another program where it runs.
        sources: names of its C files.
        step: communication step for a start [s].
        description: one sentence.
    """

    name: str
    identifier: str
    guid: str
    tool: bool
    sources: tuple[str, ...]
    step: float
    description: str


def model_description(model: Model, variables: list[Variable]) -> bytes:
    """The XML text.

    Outputs are those of the last communication point and do not follow inputs at once, which
    spares the caller algebraic loops.
    """
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.name,
        guid=model.guid,
        description=model.description,
        generationTool="rom",
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    _co_simulation(root, model)
    units = ET.SubElement(root, "UnitDefinitions")
    for name in sorted({variable.unit for variable in variables}):
        powers = {key: str(value) for key, value in UNITS[name].items()}
        ET.SubElement(ET.SubElement(units, "Unit", name=name), "BaseUnit", powers)
    categories = ET.SubElement(root, "LogCategories")
    for name in ("logStatusError", "logStatusWarning"):
        ET.SubElement(categories, "Category", name=name)
    ET.SubElement(root, "DefaultExperiment", startTime="0.0", stepSize=repr(model.step))
    listed = ET.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        _variable(listed, reference, variable)
    _structure(root, variables)
    ET.indent(root)
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True)


def _co_simulation(root: ET.Element, model: Model) -> None:
    flags = {
        "modelIdentifier": model.identifier,
        "needsExecutionTool": str(model.tool).lower(),
        "canHandleVariableCommunicationStepSize": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canNotUseMemoryManagementFunctions": "true",
    }
    files = ET.SubElement(ET.SubElement(root, "CoSimulation", flags), "SourceFiles")
    for name in model.sources:
        ET.SubElement(files, "File", name=name)


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
