"""Child process: draws the scene in a folder with VTK and leaves the pixels there.

Started by `rom.view.canvas.offscreen` as ``python -m rom.view.canvas.draw FOLDER``.
"""

import json
import sys
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from rom.model import Array, Index, Integers

Image = npt.NDArray[np.uint8]
Plotter = Any  # of pyvista
Keys = dict[str, Any]  # of a scene, or of what pyvista draws
COUNT_FILE = "count"  # as long as there are pictures drawn
EDGE_OFFSET = 2e-3  # of the picture's height, towards the eye; parallel projection does not show it
CREASE_ANGLE = 35.0  # from which an edge stays sharp in shading [degree]


def main(folder: Path) -> None:
    """Draw every frame of the scene."""
    import pyvista

    scene, arrays = read(folder)
    (width, height), times = scene["size"], scene["oversampling"]
    plotter: Plotter = pyvista.Plotter(off_screen=True, window_size=[times * width, times * height])
    plotter.set_background("white")
    aim(plotter, scene, arrays)
    n = max(len(arrays[f"points {k}"]) for k in range(len(scene["actors"])))
    pictures = np.empty((n, height, width, 3), dtype=np.uint8)
    for frame in range(n):
        show(plotter, scene, arrays, frame)
        plotter.render()
        pictures[frame] = averaged(plotter.screenshot(return_img=True)[..., :3], times)
        with (folder / COUNT_FILE).open("ab") as count:  # a byte for each
            count.write(b".")
    np.save(folder / "pictures.npy", pictures)
    plotter.close()


def read(folder: Path) -> tuple[Keys, Keys]:
    """A scene and its arrays, as `rom.view.canvas.offscreen.write_scene` leaves them."""
    with np.load(folder / "arrays.npz", allow_pickle=False) as file:
        return json.loads((folder / "scene.json").read_text()), dict(file)


def averaged(fine: Image, times: int) -> "Integers":
    """Means of blocks of pixels; a sum over axes of a reshaped array takes ten times as long."""
    total = np.full_like(fine[::times, ::times], times**2 // 2, np.uint16)
    for i, j in product(range(times), repeat=2):
        total += fine[i::times, j::times]
    return total // times**2


def aim(plotter: Plotter, scene: Keys, arrays: Keys) -> None:
    """Set the camera; its clipping range holds all frames, VTK's own would be that of the first."""
    focus, toward = arrays["focus"], arrays["toward"]
    actors = range(len(scene["actors"]))
    depth = max(abs((arrays[f"points {k}"] - focus) @ toward).max() for k in actors)
    depth = 1.01 * depth + 0.01 * scene["height"]
    reach = depth + scene["height"]
    plotter.camera_position = [tuple(focus + reach * toward), tuple(focus), tuple(arrays["up"])]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = 0.5 * scene["height"]
    plotter.camera.clipping_range = (reach - depth, reach + depth)


def show(plotter: Plotter, scene: Keys, arrays: Keys, frame: int = 0) -> None:
    """Add all actors, or replace those that move by what they are in a later frame."""
    for k in range(len(scene["actors"])):
        n = len(arrays[f"points {k}"])
        if n > 1 or not frame:
            add(plotter, scene, arrays, k, frame % n)


def add(plotter: Plotter, scene: Keys, arrays: Keys, k: int, frame: int) -> None:
    """Add an actor, or replace it by the one of the next frame."""
    style, values = scene["actors"][k], arrays.get(f"values {k}")
    points, cells = arrays[f"points {k}"][frame], arrays[f"cells {k}"]
    if cells.shape[1] < 3:  # lines and dots lie in front of the faces they are on
        points = points + EDGE_OFFSET * scene["height"] * arrays["toward"].astype(np.float32)
    grid = _grid(points, cells)
    look: Keys = {"opacity": style["opacity"], "name": f"{k}"}
    look |= {"reset_camera": False, "render": False}
    if values is None:
        look["color"] = style["colour"]
    else:
        grid.point_data["value"] = values[min(frame, len(values) - 1)]
        look |= {"scalars": "value", "cmap": scene["colours"], "clim": scene["limits"]}
        look["show_scalar_bar"] = False
    if cells.shape[1] < 3:
        look |= {"lighting": False, "line_width": scene["oversampling"] * style["width"]}
        look |= {"point_size": look["line_width"], "render_points_as_spheres": True}
    elif not style["lit"]:
        look |= {"lighting": False}
    else:
        split = {"feature_angle": CREASE_ANGLE, "split_vertices": True}
        grid = grid.compute_normals(cell_normals=False, **split)
        look |= {"smooth_shading": True, "ambient": 0.4, "diffuse": 0.65, "specular": 0.1}
    plotter.add_mesh(grid, **look)


def _grid(points: "Array", cells: "Index") -> Any:
    import pyvista

    counted = np.column_stack([np.full(len(cells), cells.shape[1]), cells]).ravel()
    given: Keys = {{1: "verts", 2: "lines", 3: "faces"}[cells.shape[1]]: counted}
    return pyvista.PolyData(points, **given)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
