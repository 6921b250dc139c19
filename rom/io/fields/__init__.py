"""Fields over meshes and motions for programs that draw.

`vtu` and `vtkhdf` for ParaView, `gltf` for browsers; `universal` reads functions of a test.
"""
