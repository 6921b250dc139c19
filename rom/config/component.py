"""The component file: a geometry, its material, and how it becomes a flexible body."""

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.arguments import Quantity, shortened, typed
from rom.config.component_keys import TABLE
from rom.config.document import Document, KeyPath, Values, read_document
from rom.config.keys import Place, read_table, read_value
from rom.config.methods import chosen
from rom.errors import ConfigError, RomError
from rom.model import Attachment, FEModel, Material, Orthotropic
from rom.units import LENGTH, in_si, unit

if TYPE_CHECKING:
    from rom.body.damping import ModalDamping, Rayleigh
    from rom.body.flexible import FlexibleBody
    from rom.body.nonlinear.ranges import Geometric

Solid = Material | Orthotropic
MANY_FOR_SCIPY = 20_000  # dofs, from where its factor takes longer than MUMPS to start
COUNTS = {"modes": "n_modes", "shapes": "n_shapes", "steps": "n_steps"}  # key: their name in Python


@dataclass(frozen=True, slots=True)
class Described:
    """What a file describes."""

    document: Document
    values: Values  # in SI, by the keys of its table
    # ``trust`` and limits of `read_mesh`, which no file can say
    meshing: Values = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the body or mechanism."""
        return str(self.values.get("name") or self.document.path.stem)

    def at(self, *path: str) -> AbstractContextManager[None]:
        """Context that tells the line of a key in errors raised below it."""
        return located(self.document, path)


class Component(Described):
    """A component as its file describes it, by the keys of `rom.config.component_keys.TABLE`."""

    __slots__ = ()

    @property
    def output(self) -> Path | None:
        """Where its body is to be written."""
        return self.values.get("output", {}).get("file")

    @property
    def kinds(self) -> Values:
        """Kinds of the interfaces, for `rom.reduce`."""
        from rom.reduction.interfaces.kinds import parsed
        from rom.reduction.interfaces.polynomial import FourierLegendre, Polynomial

        records = {"polynomial": Polynomial, "fourier": FourierLegendre}
        found = {}
        for name, value in self.values.get("interfaces", {}).items():
            options = dict(value) if isinstance(value, dict) else {"kind": value}
            kind = options.pop("kind")
            with self.at("interfaces", name):
                found[name] = records[kind](**options) if options else parsed(name, kind)
        return found

    @property
    def mesh(self) -> tuple[Path, Values]:
        """File and keywords for `rom.fe.mesh.read.read_mesh`."""
        geometry = self._section("geometry")
        own = geometry["file"].suffix.lower() in (".step", ".stp")
        if own and geometry["unit"] != "m":
            raise Place(self.document, ("geometry", "unit")).error(
                "a .step file knows its unit.", "Leave the unit out."
            )
        scale = in_si(f"1 {geometry['unit']}", "m")
        parameters = {
            name: self._parameter(name, value, scale)
            for name, value in geometry.get("parameters", {}).items()
        }
        how = {"parameters": parameters, "scale": scale, "units": geometry["units"]}
        how |= {"faces": geometry.get("faces", {}), "order": geometry.get("order")}
        return geometry["file"], how | self.meshing

    def model(self) -> FEModel:
        """The finite element model; a geometry needs FEniCSx."""
        given = [name for name in ("geometry", "matrices") if name in self.values]
        if len(given) != 1:
            what = "both geometry and matrices" if given else "neither geometry nor matrices"
            raise ConfigError(f"the component must not have {what}.", where=str(self.document.path))
        if given == ["matrices"]:
            return self._matrices()
        (file, keywords), geometry = self.mesh, self.values["geometry"]
        keywords |= {"material": self.material(), "attachments": self._attachments()}
        from rom.fe.elasticity import model  # after what the file itself may say wrong

        return model(file, degree=geometry["degree"], solver=geometry["solver"], **keywords)

    def body(self, model: FEModel | None = None) -> "FlexibleBody":
        """The reduced body, of a model that is there already or of its own."""
        from rom.workflow import reduce

        reduction, kinds = self.values["reduction"], self.kinds
        if not kinds:
            where, hint = str(self.document.path), 'For example [interfaces] and pin_a = "rbe2".'
            raise ConfigError("the component has no interface.", where=where, hint=hint)
        with self.at("reduction"):
            method = chosen(reduction, full=any(kind == "full" for kind in kinds.values()))
        how: Values = {key: reduction[key] for key in ("reference", "stress", "stiffening")}
        how |= {"method": method, "damping": self.damping(), "certify": reduction["certificate"]}
        if len(how["reference"]) == 1:
            (how["reference"],) = how["reference"]
        how |= {"interfaces": kinds, "name": self.name}
        return reduce(model or self.model(), nonlinear=self.nonlinear(), **how)

    def material(self) -> Solid | dict[str, Solid] | None:
        """`Material`, `Orthotropic`, or a dictionary of them by region; None for that of a deck."""
        from rom.fe.mesh.read import is_deck

        if "material" not in self.values and is_deck(self._section("geometry")["file"]):
            return None
        solids = self._section("material")
        if "regions" in solids:
            return {
                name: self._solid(values, "material", name)
                for name, values in solids["regions"].items()
            }
        return self._solid(solids, "material")

    def damping(self) -> "Rayleigh | ModalDamping | None":
        """Damping for `rom.reduce`."""
        from rom.body.damping import ModalDamping, Rayleigh

        if "damping" not in self.values:
            return None
        values = dict(self.values["damping"])
        fixed = tuple(values.pop("fixed"))
        if ("ratio" in values) == bool({"alpha", "beta"} & set(values)) or (
            fixed and "ratio" not in values
        ):
            raise Place(self.document, ("damping",)).error(
                "[damping] needs either ratio, and fixed if it is meant in a support, or alpha and "
                "beta."
            )
        with self.at("damping"):
            return ModalDamping(values["ratio"], fixed) if "ratio" in values else Rayleigh(**values)

    def nonlinear(self) -> "Geometric | None":
        """Loads of large deflection for `rom.reduce`; None for a body of small deflection."""
        from rom.body.nonlinear.ranges import Geometric

        values = self.values["reduction"].get("nonlinear")
        if values is None:
            return None
        given = {COUNTS.get(key, key): _tuples(value) for key, value in values.items()}
        given["loads"] = {name: (*x["force"], *x["moment"]) for name, x in values["loads"].items()}
        with self.at("reduction", "nonlinear"):
            return Geometric(**given)

    def _section(self, name: str) -> Values:
        if name not in self.values:
            raise ConfigError(f"[{name}] is missing; it is needed.", where=str(self.document.path))
        return self.values[name]

    def _solid(self, values: Values, *path: str) -> Solid:
        with self.at(*path):
            if "G" not in values:
                return Material(**values)
            return Orthotropic(**{k: _tuples(v) for k, v in values.items()})

    def _parameter(self, name: str, value: object, scale: float) -> object:
        if not isinstance(value, str):
            return value
        symbol = value.lstrip("+-.0123456789eE ") or "1"
        try:
            found = unit(symbol)
        except ConfigError:
            return value  # a text of its own, e.g. for a geometry written in Python
        place = Place(self.document, ("geometry", "parameters", name))
        if found.dimension == LENGTH:
            return float(read_value(Quantity("m"), value, place)) / scale
        with place.told():
            return in_si(value, symbol)

    def _attachments(self) -> list[Attachment]:
        return [Attachment(**values) for values in self.values.get("attachments", {}).values()]

    def _matrices(self) -> FEModel:
        from rom.io.matrices.node_files import read_node_sets
        from rom.io.matrices.read_model import read_model

        m = self.values["matrices"]
        for name in ("material", "geometry"):
            if name in self.values:
                raise Place(self.document, (name,)).error(f"matrices need no [{name}].")
        sets: Values = {
            name: [int(x) for x in labels] for name, labels in m.get("sets", {}).items()
        }
        remaining = tuple(name for name in self.values.get("interfaces", {}) if name not in sets)
        sets |= read_node_sets(m["nodes"], remaining) if remaining else {}
        files = {name: m[name] for name in ("stiffness", "mass", "damping") if name in m}
        K, M, *D = (source(text, self.document.path.parent) for text in files.values())
        how = {name: m[name] for name in ("nodes", "dofs", "units", "hold_drilling") if name in m}
        how |= {"modal": [int(x) for x in m["modal"]]}
        model = read_model(K, M, D=D[0] if D else None, interfaces=sets, **how)
        return replace(quickly_solved(model), attachments=tuple(self._attachments()))


def source(text: str, folder: Path = Path()) -> str | tuple[str, str]:
    """A file in a folder, or (file, name) from FILE:NAME."""
    path, colon, name = text.rpartition(":")
    if colon and path and not (folder / text).exists():
        return str(folder / path), name
    return str(folder / text)


def quickly_solved(model: FEModel) -> FEModel:
    """The same, large matrices by MUMPS where it is installed."""
    if model.n_dofs < MANY_FOR_SCIPY or find_spec("dolfinx") is None:
        return model
    from rom.fe import by_mumps  # which says so where FEniCSx is there and broken

    return by_mumps(model)


@contextmanager
def located(document: Document, path: KeyPath) -> Iterator[None]:
    """Context that puts file and line in front of errors raised inside."""
    try:
        yield
    except RomError as error:
        if not error.where.startswith(str(document.path)):
            where = document.where(path)
            error.where = f"{where}: {error.where}" if error.where else where
        raise


def _tuples(value: object) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


@typed
def read_component(
    path: str | Path,
    changes: Mapping[tuple[str, ...], object] | None = None,
    *,
    trust: bool = False,
    time_limit: float | None = None,
    memory_limit: float | None = None,
) -> Component:
    """A component file.

    Args:
        path: ``.toml``; its keys are listed on the page about files.
        changes: {("material", "E"): "70 GPa", ...} in place of what the file says; None removes.
        trust: run a geometry written in Python.
        time_limit: of meshing [s]; see `rom.fe.model`.
        memory_limit: of meshing [bytes].

    Raises:
        FileFormatError: if there is no such file.
        ConfigError: with every mistake and its line: unknown or missing keys, wrong units.
    """
    document = read_document(path)
    if "bodies" in document.data:
        where, hint = document.where(("bodies",)), "rom simulate moves it."
        raise ConfigError("this is a mechanism; a component is needed.", where=where, hint=hint)
    for key, value in (changes or {}).items():
        change(document.data, key, value)
    meshing = {"trust": trust, "time_limit": time_limit, "memory_limit": memory_limit}
    return Component(document, read_table(TABLE, document), meshing)


def change(data: Values, key: tuple[str, ...], value: object) -> None:
    """Put a value at a place in nested tables; None removes what is there."""
    for name in key[:-1]:
        inner = data.setdefault(name, {})
        if not isinstance(inner, dict):
            raise ConfigError(f"{name} = {shortened(inner)} must be a table, to have keys below.")
        data = inner
    if value is None:
        data.pop(key[-1], None)
    else:
        data[key[-1]] = value
