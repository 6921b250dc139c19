"""The mechanism file: bodies, joints, forces, and how they are moved."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.arguments import typed
from rom.config.component import Located, change, read_component
from rom.config.document import Document, read_document
from rom.config.keys import Place, nearest, raise_mistakes, read_table
from rom.config.laws import Pending, law_of
from rom.config.mechanism_keys import IMPACT, SECTIONS, TABLE
from rom.errors import ConfigError, warn

if TYPE_CHECKING:
    from rom.mbs.integrate.keeping import Keeping
    from rom.mbs.mechanism import Mechanism
    from rom.mbs.results.solution import Solution

GROUND = "ground"
METHODS = {  # section: method of a mechanism; in the others the kind of the entry
    "drives": "drive",
    "motors": "motor",
    "springs": "spring_damper",
    "rotational_springs": "rotational_spring",
    "bushings": "bushing",
    "forces": "force",
    "torques": "torque",
    "frictions": "friction",
    "stops": "stop",
}
ON_JOINTS = ("drives", "motors", "frictions", "stops")
# of the mechanism's size; bores of a mesh are polygons, so that small gaps are normal
GAP_RTOL = 1e-2
MARKER_KEYS = ("between", "marker")
JOINT_KEYS = ("joint", "joint1", "joint2")
MassProperties = tuple[float, Any, Any, dict[str, Any]]  # mass, centre, inertia, markers


@dataclass(frozen=True, slots=True)
class MechanismFile:
    """A mechanism as its file describes it.

    Attributes:
        document: the file.
        values: its values in SI, by the keys of `rom.config.mechanism_keys.TABLE`.
        meshing: keywords of `rom.read_component` for component files in it.
    """

    document: Document
    values: dict[str, Any]
    meshing: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Its name."""
        return str(self.values.get("name") or self.document.path.stem)

    def mechanism(self) -> "Mechanism":
        """The mechanism, ready to move; component files in it are meshed and reduced.

        Raises:
            ConfigError, ModelError: with file and line of the body, joint or force.
        """
        from rom.mbs.mechanism import Mechanism

        made = Mechanism(gravity=self.values["gravity"])
        for name, values in self.values["bodies"].items():
            with self.at("bodies", name):
                _add_body(made, name, dict(values), self.meshing)
        self._refuse_unknown_markers(made)
        for section, name, values in self._connections():
            with self.at(section, name):
                self._connect(made, section, name, dict(values))
        for name in self.values["joints"]:
            self._warn_if_apart(made, name)
        return made

    def simulate(
        self,
        made: "Mechanism | None" = None,
        *,
        progress: bool = False,
        keep: "Keeping | None" = None,
    ) -> "Solution":
        """Move it as ``[simulation]`` says.

        Args:
            made: the mechanism, if it has been built already.
            progress: report on stderr.
            keep: folder that is written while the run lasts.

        Raises:
            RomError: as `mechanism` and `rom.simulate`.
        """
        from rom.mbs.integrate.simulation import simulate

        made = self.mechanism() if made is None else made
        with self.at("simulation"):
            return simulate(made, progress=progress, keep=keep, **self.values["simulation"])

    def at(self, *path: str) -> Located:
        """Context that tells the line of a key in errors raised below it."""
        return Located(self.document, path)

    def _connections(self) -> list[tuple[str, str, dict[str, Any]]]:
        """Section, name and values; gears behind the joints they couple."""
        entries = [(s, name, v) for s in SECTIONS for name, v in self.values[s].items()]
        gears = [entry for entry in entries if entry[2].get("kind") == "gear"]
        joints = [e for e in entries if e[0] == "joints" and e not in gears]
        return [*joints, *gears, *(entry for entry in entries if entry[0] != "joints")]

    def _connect(self, made: "Mechanism", section: str, name: str, values: dict[str, Any]) -> None:
        """Call the method of the mechanism with what the entry says."""
        method = METHODS.get(section) or values.pop("kind")
        place = Place(self.document, (section, name))
        first: list[Any] = []
        for key in MARKER_KEYS:
            first += [self._marker(made, marker) for marker in _markers(values.pop(key, []))]
        for key in (key for key in JOINT_KEYS if key in values):
            joint = values.pop(key)
            if joint not in made.joints:
                hint = nearest(joint, made.joints)
                raise place.at(key).error(f"there is no joint {joint!r}.", hint)
            first.append(joint)
        turns = _turns(made, first[0], values.get("coordinate")) if section in ON_JOINTS else True
        for key, value in values.items():
            if isinstance(value, Pending):
                values[key] = value.of(turns=turns)
        adapt = SECTION_ADAPTERS.get(section)
        if adapt is not None:
            first, values = adapt(first, values, place, self.values["simulation"]["t_end"])
        getattr(made, method)(name, *first, **values)

    def _warn_if_apart(self, made: "Mechanism", name: str) -> None:
        """Two points that are to be one should be near each other at the start."""
        import numpy as np

        joint = made.joints[name]
        if not joint.one_point:
            return
        ends = [made.design_point(marker) for marker in joint.markers]
        placed = [part.at for part in made.parts.values()] + ends
        gap = float(np.linalg.norm(ends[0] - ends[1]))
        if gap > GAP_RTOL * max(float(np.ptp(placed, axis=0).max()), 1e-300):
            where = self.document.where(("joints", name))
            warn(
                f"{where}: the markers of joint {name!r} are {gap:.3g} m apart as the bodies are "
                "placed; the start pulls them together."
            )

    def _marker(self, made: "Mechanism", marker: tuple[str, Any]) -> Any:
        body, where = marker
        if body == GROUND:
            points = self.values["ground"]
            return made.ground.marker(points[where] if isinstance(where, str) else where)
        return made.parts[body].marker(where)

    def _refuse_unknown_markers(self, made: "Mechanism") -> None:
        """All of them at once, in whatever joint or force they stand."""
        top = Place(self.document)
        for section, name, values in self._connections():
            for key in MARKER_KEYS:
                place = top.at(section).at(name).at(key)
                for marker in _markers(values.get(key, [])):
                    self._note_unknown(made, marker, place)
        raise_mistakes(top)

    def _note_unknown(self, made: "Mechanism", marker: tuple[str, Any], place: Place) -> None:
        body, where = marker
        bodies = [GROUND, *made.parts]
        points = self.values["ground"] if body == GROUND else {}
        known = made.parts[body].names if body in made.parts else points
        if body not in bodies:
            place.mistakes.append(place.error(f"there is no body {body!r}.", nearest(body, bodies)))
        elif isinstance(where, str) and where not in known:
            what = "the ground has no point" if body == GROUND else f"body {body!r} has no marker"
            place.mistakes.append(place.error(f"{what} {where!r}.", nearest(where, known)))


def _markers(found: Any) -> list[Any]:
    """One marker or several of an entry, as a list."""
    return [found] if isinstance(found, tuple) else list(found)


def _turns(made: "Mechanism", joint: str, coordinate: str | None) -> bool:
    """Whether the coordinate of a joint is an angle."""
    found = made.joints[joint]
    if coordinate is not None:
        return coordinate == "angle"
    return found.coordinate is None or found.coordinate is found.turn


def _add_body(
    made: "Mechanism", name: str, values: dict[str, Any], meshing: dict[str, Any]
) -> None:
    if "." in name or name == GROUND:
        raise ConfigError(f"{name!r} is no name for a body: markers are written body.marker.")
    if "orientation" in values:
        values["orientation"] = _orientation(values["orientation"])
    if "file" not in values:
        made.add_rigid(name, **values)
        return
    file, rigid = values.pop("file"), values.pop("rigid")
    reference = values.pop("reference", None)
    if rigid:
        _add_rigid_from(made, name, _mass_of(file, meshing), values)
        return
    body = _body_of(file, meshing)
    if reference is not None:
        body = body.with_reference(reference[0] if len(reference) == 1 else reference)
    made.add_flexible(name, body, **values)


def _orientation(value: Any) -> Any:
    from rom import rotation
    from rom.arguments import unit_vector

    if not isinstance(value, Mapping):
        return value
    return rotation.exp(value["angle"] * unit_vector("axis", value["axis"]))


def _body_of(file: Path, meshing: dict[str, Any]) -> Any:
    from rom.io.native import load

    return read_component(file, **meshing).body() if file.suffix == ".toml" else load(file)


def _add_rigid_from(
    made: "Mechanism", name: str, known: MassProperties, values: dict[str, Any]
) -> None:
    """A rigid body with the mass properties and interfaces of a body or a component."""
    import numpy as np

    from rom.arguments import start_pose
    from rom.rotation import matrix

    mass, centre, inertia, points = known
    pose = (values.get(key) for key in ("orientation", "velocity", "omega"))
    at, p, velocity, omega = start_pose(values["at"], *pose)
    A = matrix(p)
    made.add_rigid(
        name,
        mass=mass,
        inertia=inertia,
        at=at + A @ centre,
        orientation=p,
        markers={key: x - centre for key, x in points.items()},
        velocity=velocity + A @ np.cross(omega, centre),
        omega=omega,
    )


def _mass_of(file: Path, meshing: dict[str, Any]) -> MassProperties:
    """Mass, centre (3,), inertia (3, 3) about it, and interface points by name."""
    import numpy as np

    from rom.io.native import load

    if file.suffix == ".toml":
        from rom.workflow import mass_properties

        model = read_component(file, **meshing).model()
        found = mass_properties(model)
        points = {key: interface.origin for key, interface in model.interfaces.items()}
        return found.mass, found.centre, found.inertia, points
    body = load(file)
    c = body.first_moment / body.mass
    inertia = body.inertia - body.mass * (c @ c * np.eye(3) - np.outer(c, c))
    return body.mass, c, inertia, {key: marker.point for key, marker in body.markers.items()}


def _drive(first: list[Any], values: dict[str, Any], place: Place, t_end: float) -> Any:
    law = law_of(values["law"], place.at("law"), t_end=t_end)
    return [*first, law.value], {"rate": law.rate, "acceleration": law.acceleration}


def _motor(first: list[Any], values: dict[str, Any], place: Place, t_end: float) -> Any:
    remaining = {key: value for key, value in values.items() if key != "law"}
    if not isinstance(values["law"], Mapping):
        constant = values["law"]
        return [*first, lambda t, x, rate: constant], remaining
    value = law_of(values["law"], place.at("law"), t_end=t_end).value
    return [*first, lambda t, x, rate: float(value(t))], remaining | {"compiled": False}


def _load(first: list[Any], values: dict[str, Any], place: Place, t_end: float) -> Any:
    import numpy as np

    vector = np.array(values["vector"])
    remaining = {"frame": values["frame"]}
    if "factor" not in values:
        return [*first, vector], remaining
    factor = law_of(values["factor"], place.at("factor"), t_end=t_end).value
    return [*first, lambda t: float(factor(t)) * vector], remaining


def _bushing(first: list[Any], values: dict[str, Any], _place: Place, _t_end: float) -> Any:
    for key in ("stiffness", "damping"):
        values[key] = [*values[key], *values.pop(f"turning_{key}")]
    return first, values


def _impact(first: list[Any], values: dict[str, Any], _place: Place, _t_end: float) -> Any:
    from rom.mbs.elements.contact.impact import Impact

    numbers = {key.name: values.pop(key.name) for key in IMPACT if key.name in values}
    return [*first, Impact(**numbers)], values


SECTION_ADAPTERS = {
    "drives": _drive,
    "motors": _motor,
    "forces": _load,
    "torques": _load,
    "bushings": _bushing,
    "stops": _impact,
    "contacts": _impact,
}


@typed
def read_mechanism(
    path: str | Path,
    changes: Mapping[tuple[str, ...], Any] | None = None,
    *,
    trust: bool = False,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> MechanismFile:
    """A mechanism file.

    Args:
        path: ``.toml``; its keys are listed on the page about files.
        changes: {("simulation", "t_end"): "1 s", ...} in place of what the file says; None removes.
        trust: run geometries written in Python.
        time_limit: of meshing a body [s]; see `rom.fe.model`.
        memory_limit: of meshing a body [bytes].

    Raises:
        FileFormatError: if there is no such file.
        ConfigError: with every mistake and its line: unknown or missing keys, wrong units.
    """
    document = read_document(path)
    if "bodies" not in document.data and {"geometry", "matrices"} & set(document.data):
        raise ConfigError(
            "this is a component; a mechanism is needed.", where=str(path),
            hint="A mechanism has [bodies], one of which may have this file.",
        )  # fmt: skip
    for key, value in (changes or {}).items():
        change(document.data, key, value)
    meshing = {"trust": trust, "time_limit": time_limit, "memory_limit": memory_limit}
    file = MechanismFile(document, read_table(TABLE, document), meshing)
    with file.at("simulation", "dt"):
        _check_step(file.values["simulation"])
    return file


def _check_step(simulation: dict[str, Any]) -> None:
    t_end, dt = simulation["t_end"], simulation.get("dt")
    if dt is not None and dt > t_end:
        raise ConfigError(f"dt = {dt:g} s is longer than t_end = {t_end:g} s.")
