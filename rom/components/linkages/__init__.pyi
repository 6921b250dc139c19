from rom.components.linkages.chains import Link as Link
from rom.components.linkages.dynamic_isotropy import Isotropic as Isotropic
from rom.components.linkages.dynamic_isotropy import angle_grid as angle_grid
from rom.components.linkages.dynamic_isotropy import closed_loci as closed_loci
from rom.components.linkages.dynamic_isotropy import index_map as index_map
from rom.components.linkages.dynamic_isotropy import (
    isotropic_configurations as isotropic_configurations,
)
from rom.components.linkages.dynamic_isotropy import isotropy_index as isotropy_index
from rom.components.linkages.isotropic_sets import IsotropicSet as IsotropicSet
from rom.components.linkages.isotropic_sets import ToolIsotropy as ToolIsotropy
from rom.components.linkages.isotropic_sets import isotropic_set as isotropic_set
from rom.components.linkages.isotropic_sets import tool_isotropy as tool_isotropy
from rom.components.linkages.prismatic_linkages import CrossSlides as CrossSlides
from rom.components.linkages.prismatic_linkages import PolarArm as PolarArm
from rom.components.linkages.prismatic_linkages import SlideArm as SlideArm
from rom.components.linkages.prismatic_linkages import SlideFiveBar as SlideFiveBar
from rom.components.linkages.two_dof_linkages import Driven as Driven
from rom.components.linkages.two_dof_linkages import FiveBar as FiveBar
from rom.components.linkages.two_dof_linkages import TwoLink as TwoLink
from rom.components.linkages.two_dof_linkages import mechanism_inertia as mechanism_inertia
from rom.components.linkages.two_dof_linkages import reduced_link as reduced_link
from rom.components.linkages.two_dof_linkages import rigid_link as rigid_link
from rom.components.linkages.two_dof_linkages import rod as rod
