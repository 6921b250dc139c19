from rom.assembly.assembly import Assembly as Assembly
from rom.assembly.condensed import CondensedAssembly as CondensedAssembly
from rom.assembly.dual import DualAssembly as DualAssembly
from rom.assembly.dual import FreeSubstructure as FreeSubstructure
from rom.assembly.dual import free_substructure as free_substructure
