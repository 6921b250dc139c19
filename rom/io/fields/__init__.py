"""Fields over meshes and motions for programs that draw: ParaView, glTF, UFF."""
