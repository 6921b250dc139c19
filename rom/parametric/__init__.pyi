from rom.components.families.assembled import FamilyAssembly as FamilyAssembly
from rom.components.families.family import BodyFamily as BodyFamily
from rom.components.families.parameters import Density as Density
from rom.components.families.parameters import Parameter as Parameter
from rom.components.families.parameters import Thickness as Thickness
from rom.components.families.parameters import YoungsModulus as YoungsModulus
from rom.components.families.reduce import reduce_parametric as reduce_parametric
