"""Files, meshes and texts that tests write, damage and read."""
