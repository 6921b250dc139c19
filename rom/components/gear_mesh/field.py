"""What gear meshes have for mechanisms, their files and pictures."""

from rom.fields import Field

FIELD = Field(
    families=("rom.components.gear_mesh.gears.meshes:GEAR_MESHES_FAMILY",),
    methods={
        "gear_mesh": "rom.components.gear_mesh.gears.meshes:gear_mesh",
        "gear_meshes": "rom.components.gear_mesh.gears.meshes:GearMesh",
    },
    sections={"gear_meshes": "rom.components.gear_mesh.keys:SECTION"},
    symbols={"gear_meshes": "rom.components.gear_mesh.symbols:draw"},
    moved={
        "rom.mbs.elements.gears": "rom.components.gear_mesh.gears",
        "rom.mbs.results.tooth_loads": "rom.components.gear_mesh.tooth_loads",
    },
)
