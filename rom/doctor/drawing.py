"""Child process: draw a sphere off-screen and say which window drew it."""

import json
import sys
import time
from typing import Any


def main() -> None:
    """Write one JSON line per thing found."""
    import pyvista
    import vtk

    _write("pyvista", version=pyvista.__version__)
    _write("vtk", version=vtk.vtkVersion().GetVTKVersion())
    began = time.perf_counter()
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[200, 200])
    plotter.add_mesh(pyvista.Sphere())
    picture = plotter.screenshot(return_img=True)
    _write(
        "picture",
        window=plotter.ren_win.GetClassName(),
        contrast=float(picture.std()),
        seconds=round(time.perf_counter() - began, 2),
    )
    plotter.close()


def _write(name: str, **found: Any) -> None:
    sys.stdout.write(json.dumps({"name": name, **found}) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
