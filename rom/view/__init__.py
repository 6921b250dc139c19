"""Pictures and films, drawn off-screen in a process that never loads dolfinx."""

from rom.view.canvas.solids import box, cylinder
from rom.view.figures.curves import campbell, convergence, frequencies, history
from rom.view.figures.fields import Drawing, plane
from rom.view.figures.panels import Panel, panels
from rom.view.figures.sheets import Shape, deformed, flow
from rom.view.figures.updating import updating
from rom.view.scenes.film import animate, instants
from rom.view.scenes.mechanisms import start
from rom.view.scenes.meshes import mesh
from rom.view.scenes.mode_shapes import mode_shapes
from rom.view.scenes.rods import sleeves
from rom.view.scenes.wheels import wheel_modes

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
