"""The keys of a component file."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rom.arguments import Number, Positive, Quantity, Whole
from rom.config.declared import Declared
from rom.config.document import Values
from rom.config.keys import (
    Either,
    Flag,
    Key,
    Named,
    Place,
    Table,
    Text,
    Variants,
    anything,
    file_path,
    output_path,
    words,
    written,
)
from rom.config.methods import METHODS
from rom.fe.mesh.picks import picks
from rom.units import LENGTH, SYSTEMS, UNITS

LENGTHS = tuple(name for name, u in UNITS.items() if u.dimension == LENGTH)
ISOTROPIC = Declared("rom.material:Material")
ORTHOTROPIC = Declared(
    "rom.material:Orthotropic",
    Key("axes", Number("1", (3, 3)), "Rows are the axes 1, 2, 3 in the geometry."),
    about="An orthotropic solid, known by its key G.",
)
LABELS = Quantity("1", ((None,),))  # of nodes
SHAPES = "rom.reduction.interfaces.polynomial"


SOLID = Variants(
    {"isotropic": ISOTROPIC, "orthotropic": ORTHOTROPIC}, {"G": "orthotropic"}, "isotropic"
)


@dataclass(frozen=True, slots=True)
class Solids:
    """One material, or a table of them by region."""

    parts: ClassVar[Mapping[str, Table]] = SOLID.tables
    summary: str = "isotropic or orthotropic table, or a table of them by region"

    def read(self, value: object, place: Place) -> Values:
        """Values of the material, or of each region under "regions"."""
        several = value.values() if isinstance(value, Mapping) else ()
        if several and all(isinstance(v, dict) for v in several):
            return {"regions": Named(SOLID, "materials").read(value, place)}
        return SOLID.read(value, place)


@written("number, point, or text as `radius:0.006`")
def faces(value: object, place: Place) -> object:
    """What picks faces of a STEP file."""
    with place.told():
        picks(value)
    return value


KINDS = {
    "full": Table("Keeps all its dofs.", ()),
    "rbe2": Table("Moves as a rigid surface.", ()),
    "rbe3": Table("Moves freely about its mean.", ()),
    "polynomial": Declared(f"{SHAPES}:Polynomial"),
    "fourier": Declared(f"{SHAPES}:FourierLegendre"),
}
INTERFACE = Either(Text(), Variants(KINDS))
TABLE = Table("A component.", (
    Key("name", Text(), "Name of the body; that of the file if missing."),
    Key("geometry", Table("The solid as a geometry or mesh; needs FEniCSx.", (
        Key("file", file_path, "`.geo .py .step .msh .unv .med .inp .bdf` or `.cdb`.", ...),
        Key("unit", Text(LENGTHS), "Length unit of its coordinates; a `.step` knows its own.", "m"),
        Key("units", Text(tuple(SYSTEMS)), "Unit system of a deck, with the materials it says; in "
            "place of a unit.", "SI"),
        Key("degree", Whole(1, 3), "Degree of the displacement, 1 to 3.", 2),
        Key("order", Whole(1, 2), "Degree of the cells' edges: 1 straight, 2 curved; 2 where the "
            "geometry is curved if missing."),
        Key("solver", Text(), "How equations are solved: direct, low-rank, out-of-core, "
            "low-rank+out-of-core or iterative; auto is direct where its factor fits, else "
            "out-of-core, else iterative.", "auto"),
        Key("parameters", Named(anything, "parameters"),
            "Parameters of the geometry. A plain number goes there as it is; a length with its "
            "unit is converted to that of the geometry (`.step`: to metres), another quantity "
            "to SI."),
        Key("faces", Named(faces, "faces"),
            "Names for faces of a `.step`: a number; a point [m]; \"radius:0.006\" for all "
            "cylinders of that radius [m]; \"normal:0,0,1\" for the plane that looks there; "
            "\"3+4\" or a list for several."),
    )), "The solid as a geometry or mesh."),
    Key("matrices", Table("The solid as matrices of another program, in place of a geometry.", (
        Key("stiffness", Text(), "File, `:NAME` behind it where it holds several.", ...),
        Key("mass", Text(), "Likewise.", ...),
        Key("damping", Text(), "Likewise, where there is one."),
        Key("nodes", file_path, "`.inp`, `.bdf`, `.dat`, `.pch`, `.asm`, `.dmig` or `.csv`.", ...),
        Key("dofs", file_path, "What rows without labels are: `.csv` with lines label, component; "
            "`.mapping` of Ansys; `.pch` or `.asm` with EXTRN."),
        Key("units", Text(tuple(SYSTEMS)), "Unit system of the files.", "SI"),
        Key("modal", LABELS, "Labels whose rows are amplitudes of modes.", ()),
        Key("hold_drilling", Flag(), "Leave out rotations without stiffness and mass.", False),
        Key("sets", Named(LABELS, "labels"),
            "Labels of the nodes of an interface, where the `.inp` has no set of its name."),
    )), "The solid as matrices of another program."),
    Key("material", Solids(), "What it is made of; by region where there are several. A deck "
        "may say it."),
    Key("interfaces", Named(INTERFACE, "interfaces"),
        "Surfaces through which it touches others, and their kinds."),
    Key("attachments", Named(Declared(
        "rom.model:Attachment", about="A rigid body on an interface.", mass=Positive("kg"),
    ), "attachments"), "Rigid bodies and point masses it carries."),
    Key("reduction", Table("How it is reduced.", (
        Key("method", Text(tuple(METHODS)), "Which modes are kept: craig-bampton, enhanced (the "
            "same, corrected), guyan (none), rubin or herting (free-free modes and statics), "
            "moment-matching (exact somewhere), balanced (what the interfaces know), free-free "
            "(no joint may clamp it), assumed (those under the reference alone).", "craig-bampton"),
        Key("modes", Whole(), "How many modes; if missing, as many as the certificate needs, of "
            "methods other than craig-bampton 20, of moment-matching blocks per frequency 2."),
        Key("f_max", Positive("Hz"), "All modes of craig-bampton up to here instead."),
        Key("tol", Positive("1"), "The fewest modes of craig-bampton with this relative error up "
            "to f_max, or else of the lowest six in every support; 5e-4 if missing."),
        Key("at", Quantity("Hz", ((None,),)),
            "Where moment-matching is to be exact; 0 if missing."),
        Key("characteristic", Whole(), "Full interfaces follow so many characteristic modes."),
        Key("gravity_shapes", Flag(), "Keep the answers to gravity along each axis.", False),
        Key("reference", words, "The frame: mean-axis, an interface, or two of them.",
            ("mean-axis",)),
        Key("stiffening", Flag(), "Add the geometric stiffness of rotation and of loads on "
            "interfaces.", False),
        Key("nonlinear", Declared(
            "rom.body.nonlinear.ranges:Geometric",
            Key("loads", Named(Table("The largest load on an interface, of either sign.", (
                Key("force", Quantity("N", ((3,),)), "Along the axes of the geometry.", (0.0,) * 3),
                Key("moment", Quantity("N m", ((3,),)), "About the same axes.", (0.0,) * 3),
            )), "loads"), "Largest loads by interface.", ...),
            Key("modes", Whole(), "So many of the lowest modes drag others along.", 4),
            Key("shapes", Whole(1), "So many shapes are added; as tol asks if missing."),
            Key("steps", Whole(1), "States on the way to the largest load.", 4),
            Key("about", Quantity("m", ((3,),)), "A point of its axis; the reference if missing."),
            Key("fixed", words, "Held beside the reference, wholly or as `name:yz`.", ()),
            about="Loads under which it is to deflect far, and shapes for them.",
            without="n_modes n_shapes n_steps",
            spin=Quantity("rad/s", ((3,),)),
        ), "Reach large deflection."),
        Key("stress", Flag(), "Make stress on the surface recoverable.", False),
        Key("certificate", Flag("full"), "Compare with the full model; full: in every support, "
            "however long it takes.", True),
    )), "How it is reduced.", {}),
    Key("damping", Table("Structural damping: a ratio, or alpha and beta.", (
        Key("ratio", Quantity(), "Damping ratio of every mode, e.g. 0.01."),
        Key("fixed", words, "Interfaces held where the ratio is meant, wholly or as `name:yz`; "
            "those of the free body without it.", ()),
        Key("alpha", Quantity("1/s"), "D = alpha M + beta K."),
        Key("beta", Quantity("s"), "D = alpha M + beta K."),
    )), "Structural damping; none if missing."),
    Key("modes", Table("What `rom modes` computes.", (
        Key("number", Whole(1), "Number of modes, rigid ones too.", 12),
        Key("fixed", words, "Interfaces held, wholly or as `name:yz`.", ()),
        Key("spring", words, "Stiffness to the ground, `name=kx,ky,kz` or six numbers.", ()),
    )), "What `rom modes` computes.", {}),
    Key("output", Table("What `rom reduce` writes.", (
        Key("file", output_path, "The body file, `.rom.npz`.", ...),
    )), "What `rom reduce` writes."),
))  # fmt: skip
