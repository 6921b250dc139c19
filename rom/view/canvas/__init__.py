"""What pictures are drawn on: pages, scenes, and the process that draws.

`page` is a sheet in pixels, `picture` the figure it is, `style` its look, `scales` units; `scene`
actors and cameras, `corner` axes and length, `solids` simple shapes, `symbols` those of machine
drawings; `offscreen` starts the process of `draw`; `films` are written as GIF or by ffmpeg.
"""
