"""Pictures and films, drawn off-screen in a process that never loads dolfinx."""

from rom.view.curves import campbell, convergence, frequencies, history
from rom.view.film import animate, instants
from rom.view.panels import Panel, panels
from rom.view.part import mesh
from rom.view.plane import Shape, deformed, flow
from rom.view.planes import Drawing, plane
from rom.view.rods import sleeves
from rom.view.shapes import mode_shapes
from rom.view.solids import box, cylinder
from rom.view.spectra import updating
from rom.view.start import start
from rom.view.wheels import wheel_modes

__all__ = [
    "Drawing",
    "Panel",
    "Shape",
    "animate",
    "box",
    "campbell",
    "convergence",
    "cylinder",
    "deformed",
    "flow",
    "frequencies",
    "history",
    "instants",
    "mesh",
    "mode_shapes",
    "panels",
    "plane",
    "sleeves",
    "start",
    "updating",
    "wheel_modes",
]
