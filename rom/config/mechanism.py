"""The mechanism file: bodies, joints, forces, and how they are moved."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rom.arguments import start_pose, typed
from rom.config.component import Described, change, located, read_component
from rom.config.connections import GROUND, Entry, check_name, pose_of
from rom.config.document import Values, read_document
from rom.config.keys import Place, nearest, raise_mistakes, read_table
from rom.config.laws import Pending
from rom.config.mechanism_keys import mechanism_table, sections
from rom.config.python_files import check_trust, python_entries
from rom.errors import ConfigError, warn
from rom.fields import find
from rom.rotation import matrix

if TYPE_CHECKING:
    from rom.mbs.integrate.keeping import Keeping
    from rom.mbs.mechanism import Mechanism
    from rom.mbs.results.solution import Solution
    from rom.model import Array

    MassProperties = tuple[float, Array, Array, dict[str, Array]]  # mass, centre, inertia, markers

# of the mechanism's size; bores of a mesh are polygons, so that small gaps are normal
GAP_RTOL = 1e-2
LEAST_SIZE = 1e-6  # [m], where all markers are in one point
MARKER_KEYS = ("between", "marker", "markers", "path")
JOINT_KEYS = ("joint", "joint1", "joint2")


class MechanismFile(Described):
    """A mechanism as its file describes it, by the keys of `rom.config.mechanism_keys`."""

    __slots__ = ()

    def mechanism(self) -> "Mechanism":
        """The mechanism, ready to move; component files in it are meshed and reduced."""
        from rom.mbs.mechanism import Mechanism

        for path, file in python_entries(self.document):
            check_trust(file, Place(self.document, path), trust=self.meshing.get("trust", False))
        made = Mechanism(gravity=self.values["gravity"])
        for name, values in self.values["bodies"].items():
            with self.at("bodies", name):
                _add_body(made, name, dict(values), self.meshing)
        for section, name, values in self._entries(bodies=True):
            with self.at(section, name):
                self._connect(made, section, name, dict(values))
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
        """Move it as ``[simulation]`` says, or what was made of it already.

        Progress is told on stderr; a folder to keep is written while the run lasts.
        """
        from rom.mbs.integrate.simulation import simulate

        made = self.mechanism() if made is None else made
        with self.at("simulation"):
            return simulate(made, progress=progress, keep=keep, **self.values["simulation"])

    def _entries(self, *, bodies: bool) -> list[tuple[str, str, Values]]:
        some = [name for name, section in sections().items()
                if section.bodies is bodies and not section.single]  # fmt: skip
        return [(s, name, values) for s in some for name, values in self.values[s].items()]

    def _connections(self) -> list[tuple[str, str, Values]]:
        """Section, name and values; gears behind the joints they couple."""
        entries = self._entries(bodies=False)
        gears = [entry for entry in entries if entry[2].get("kind") == "gear"]
        joints = [e for e in entries if e[0] == "joints" and e not in gears]
        return [*joints, *gears, *(entry for entry in entries if entry[0] != "joints")]

    def _connect(self, made: "Mechanism", section: str, name: str, values: Values) -> None:
        place = Place(self.document, (section, name))
        markers = [marker for key in MARKER_KEYS for marker in _markers(values.pop(key, []))]
        ends: list[Any] = [self._marker(made, marker) for marker in markers]
        marker_names = [f"{body}.{where}" for body, where in markers]
        for key in (key for key in JOINT_KEYS if key in values):
            joint = values.pop(key)
            if joint not in made.joints:
                hint = nearest(joint, made.joints)
                raise place.at(key).error(f"there is no joint {joint!r}.", hint)
            ends.append(joint)
        for key, value in values.items():
            if isinstance(value, Pending):
                values[key] = value.of(turns=_turns(made, ends[0], values.get("coordinate")))
        end, trust = self.values["simulation"]["t_end"], self.meshing.get("trust", False)
        named = (ends, marker_names)
        Entry(made, section, name, *named, values, place, end, trust).connect()

    def _warn_if_apart(self, made: "Mechanism", name: str) -> None:
        """Two points that are to be one should be near each other at the start."""
        joint = made.joints[name]
        if not joint.one_point:
            return
        ends = [made.design_point(marker) for marker in joint.markers]
        placed = [part.at for part in made.parts.values()] + ends
        gap = float(np.linalg.norm(ends[0] - ends[1]))
        if gap > GAP_RTOL * max(float(np.ptp(placed, axis=0).max()), LEAST_SIZE):
            where = self.document.where(("joints", name))
            warn(
                f"{where}: the markers of joint {name!r} are {gap:.3g} m apart as the bodies are "
                "placed; the start pulls them together."
            )

    def _marker(self, made: "Mechanism", marker: tuple[str, Any]) -> Any:
        body, where = marker
        if body == GROUND and isinstance(where, str):
            where = self.values["ground"][where]
        if isinstance(where, str):
            return made.marker(f"{body}.{where}")
        return made.part(body).marker(where)

    def _refuse_unknown_markers(self, made: "Mechanism") -> None:
        """All of them at once, in whatever joint or force they stand."""
        top = Place(self.document)
        for section, name, values in self._connections():
            for key in MARKER_KEYS:
                place = top.at(section).at(name).at(key)
                for marker in _markers(values.get(key, [])):
                    self._note_unknown(made, marker, place)
        raise_mistakes(top)

    def _note_unknown(self, made: "Mechanism", marker: tuple[str, object], place: Place) -> None:
        body, where = marker
        names: Values = {GROUND: self.values["ground"]}
        names |= {key: made.parts[key].names for key in self.values["bodies"]}
        for key, one in made.nonlinear.items():  # its ends, and all frames by number
            names[key] = [*one.body.places, *map(str, range(len(one.parts)))]
        if body not in names:
            place.note(f"there is no body {body!r}.", nearest(body, names))
            return
        rod = made.nonlinear.get(body)
        if isinstance(where, str) and where not in names[body]:
            what = "the ground has no point" if body == GROUND else f"body {body!r} has no marker"
            known = names[body] if rod is None else rod.body.places
            place.note(f"{what} {where!r}.", nearest(where, known))
        elif not isinstance(where, str) and rod is not None:
            frames = f'"{body}.start", "{body}.end" or "{body}.3" for its frame 3'
            place.note(f"rod {body!r} has no points of its own.", f"Write {frames}.")


def _markers(found: Any) -> list[Any]:
    return [found] if isinstance(found, tuple) else list(found)


def _turns(made: "Mechanism", joint: str, coordinate: str | None) -> bool:
    """Whether the coordinate of a joint is an angle."""
    found = made.joints[joint]
    if coordinate is not None:
        return coordinate == "angle"
    return found.coordinate is None or found.coordinate is found.turn


def _add_body(made: "Mechanism", name: str, values: Values, meshing: Values) -> None:
    check_name(name)
    values |= pose_of(values)
    if "file" not in values:
        made.add_rigid(name, **values)
        return
    file, rigid = values.pop("file"), values.pop("rigid")
    reference = values.pop("reference", None)
    if rigid:
        if "q" in values or "qd" in values:
            raise ConfigError("a rigid body has no elastic coordinates; leave q and qd out.")
        _add_rigid_from(made, name, _mass_of(file, meshing), values)
        return
    from rom.io.native import load

    described = file.suffix == ".toml"
    body = read_component(file, **meshing).body() if described else load(file)
    if reference is not None:
        body = body.with_reference(reference[0] if len(reference) == 1 else reference)
    made.add_flexible(name, body, **values)


def _add_rigid_from(made: "Mechanism", name: str, known: "MassProperties", values: Values) -> None:
    """A rigid body with the mass properties and interfaces of a body or a component."""
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
        spin=values.get("spin"),
    )


def _mass_of(file: Path, meshing: Values) -> "MassProperties":
    """Mass, centre (3,), inertia (3, 3) about it, and interface points by name."""
    from rom.io.native import load

    if file.suffix == ".toml":
        from rom.reduction.full_model import mass_properties

        model = read_component(file, **meshing).model()
        found = mass_properties(model)
        points = {key: interface.origin for key, interface in model.interfaces.items()}
        return found.mass, found.centre, found.inertia, points
    body = load(file)
    c = body.first_moment / body.mass
    inertia = body.inertia - body.mass * (c @ c * np.eye(3) - np.outer(c, c))
    return body.mass, c, inertia, {key: marker.point for key, marker in body.markers.items()}


@typed
def read_mechanism(
    path: str | Path,
    changes: Mapping[tuple[str, ...], object] | None = None,
    *,
    trust: bool = False,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> MechanismFile:
    """A mechanism file.

    Args:
        path: ``.toml``; its keys are listed on the page about files.
        changes: {("simulation", "t_end"): "1 s", ...} in place of what the file says; None removes.
        trust: run geometries and functions written in Python.
        time_limit: of meshing a body [s]; see `rom.fe.model`.
        memory_limit: of meshing a body [bytes].

    Raises:
        FileFormatError: if there is no such file.
        ConfigError: with every mistake and its line: unknown or missing keys, wrong units.
    """
    document = read_document(path)
    if "bodies" not in document.data and {"geometry", "matrices"} & set(document.data):
        hint = "A mechanism has [bodies], one of which may have this file."
        where = document.where(())
        raise ConfigError("this is a component; a mechanism is needed.", where=where, hint=hint)
    bodies = (name for name, section in sections().items() if section.bodies)
    if not {"bodies", *bodies} & set(document.data):
        hint = "Add [bodies.NAME]."
        raise ConfigError("bodies is missing.", where=document.where(()), hint=hint)
    for name in document.data.keys() - sections().keys():
        with located(document, (name,)):
            find("sections", name)  # of a field that is not here
    for key, value in (changes or {}).items():
        change(document.data, key, value)
    meshing = {"trust": trust, "time_limit": time_limit, "memory_limit": memory_limit}
    file = MechanismFile(document, read_table(mechanism_table(), document), meshing)
    with file.at("simulation", "dt"):
        t_end, dt = (file.values["simulation"].get(key) for key in ("t_end", "dt"))
        if dt is not None and dt > t_end:
            raise ConfigError(f"dt = {dt:g} s must be at most t_end = {t_end:g} s.")
    return file
