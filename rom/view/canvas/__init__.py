"""What pictures are drawn on: pages, scenes, and the process that draws.

`page` is a sheet in pixels, `scene` actors and cameras, `solids` simple shapes; `offscreen` starts
the process of `draw`, `gif` writes films.
"""
