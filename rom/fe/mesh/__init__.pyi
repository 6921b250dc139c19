from rom.fe.mesh.read import LARGEST_FILE as LARGEST_FILE
from rom.fe.mesh.read import READERS as READERS
from rom.fe.mesh.read import FlatMesh as FlatMesh
from rom.fe.mesh.read import read_mesh as read_mesh
from rom.fe.mesh.read import read_triangles as read_triangles
from rom.fe.mesh.read import to_dolfinx as to_dolfinx
from rom.fe.mesh.validate import checked as checked
