"""What pictures are drawn on: pages, scenes, and the process that draws.

`page` is a sheet in pixels, `picture` the figure it is, `scales` units; `scene` actors and cameras,
`solids` simple shapes, `symbols` those of machine drawings; `offscreen` starts the process of
`draw` and gives all pictures their look; `films` are written as GIF or by ffmpeg.
"""
