"""Fronts of packages: the names of a stub, whose modules are loaded when one is first asked for."""

# Of what Python has not loaded itself nothing is imported here, for the reason in `rom`.
import importlib
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from types import ModuleType
    from typing import Any
else:
    ModuleType = type(sys)


class Front(ModuleType):
    """A package that has the names of the stub beside it."""

    PACKAGES: tuple[str, ...]  # modules and packages in it that the stub names
    MODULES: dict[str, str]  # {other name: module that has it}
    __all__: list[str]

    def __getattr__(self, name: str) -> object:
        """Import a name on first use."""
        if name in self.PACKAGES:
            return importlib.import_module(f"{self.__name__}.{name}")
        if name in self.MODULES:
            try:
                return getattr(importlib.import_module(self.MODULES[name]), name)
            except ModuleNotFoundError as error:
                from rom.fields import missing

                raise missing(name, self.MODULES[name], error) from None
        text = f"module {self.__name__!r} has no attribute {name!r}"
        if not name.startswith("_"):
            from difflib import get_close_matches

            near = get_close_matches(name, dir(self), cutoff=0.5)
            text += f"; near are {near}" if near else ""
        raise AttributeError(text)

    def __setattr__(self, name: str, value: object) -> None:
        """Keep a function's name when Python has loaded a module of the same name below."""
        if name not in self.MODULES or value is not sys.modules.get(f"{self.__name__}.{name}"):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*self.__all__, *self.PACKAGES})


class Moved:
    """Finds modules of fields under their earlier names, which pickles of then have."""

    def find_spec(self, name: str, *_: object) -> object:
        """Where a module is, if it was moved."""
        if not name.startswith("rom.") or f"{name}.".startswith("rom.components."):
            return None
        from importlib.util import find_spec, spec_from_loader

        from rom.fields import names

        moved = [pair for pair in names("moved").items() if f"{name}.".startswith(f"{pair[0]}.")]
        place = next((f"{new}{name[len(old) :]}" for old, new in moved), "")
        if not place or find_spec(place) is None:
            return None
        self.module = importlib.import_module(place)
        self.spec = self.module.__spec__
        package = hasattr(self.module, "__path__")  # an empty one, so that its modules come here
        return spec_from_loader(name, self, is_package=package)  # type: ignore[arg-type]

    def create_module(self, spec: "Any") -> ModuleType | None:
        """The module itself."""
        return self.module if spec.submodule_search_locations is None else None

    def exec_module(self, module: ModuleType) -> None:
        """It has run already."""
        module.__spec__ = self.spec if module is self.module else module.__spec__


sys.meta_path.append(Moved())  # type: ignore[arg-type]


def front(package: str) -> None:
    """Let a package have the names of the stub beside it, which is the only list of them."""
    module: Any = sys.modules[package]
    named = _named(package, module.__path__[0])
    module.PACKAGES = tuple(name for name, place in named.items() if place == package)
    module.MODULES = {name: place for name, place in named.items() if place != package}
    module.__all__ = sorted(module.MODULES)
    module.__class__ = Front


def _named(package: str, folder: str) -> dict[str, str]:
    """{name: module that has it, or the package for its modules}, read without loading ``ast``."""
    with open(f"{folder}/__init__.pyi", encoding="utf-8") as stub:
        text = stub.read().replace("(\n", "").replace(",\n)", "")  # lines that are too long
    lines = (line.split() for line in text.splitlines() if line.startswith("from rom"))
    return {name: module for _, module, _, name, *_ in lines}
