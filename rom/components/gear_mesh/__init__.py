"""Gear meshes: involute pairs, compliance of their teeth, contact on the base plane."""

from rom.components.gear_mesh.compliance import (
    contact_compliance,
    iso_stiffness,
    pair_stiffness,
    stiffness_table,
    tooth_compliance,
)
from rom.components.gear_mesh.contact import (
    Correction,
    Mesh,
    MeshForce,
    Slices,
    transmission_error,
)
from rom.components.gear_mesh.geometry import GearPair, line_length
from rom.components.gear_mesh.tooth_elements import ToothModel, element_table, tooth_model

__all__ = [
    "Correction",
    "GearPair",
    "Mesh",
    "MeshForce",
    "Slices",
    "ToothModel",
    "contact_compliance",
    "element_table",
    "iso_stiffness",
    "line_length",
    "pair_stiffness",
    "stiffness_table",
    "tooth_compliance",
    "tooth_model",
    "transmission_error",
]
