from rom.parametric.assembled import FamilyAssembly as FamilyAssembly
from rom.parametric.family import BodyFamily as BodyFamily
from rom.parametric.parameters import Density as Density
from rom.parametric.parameters import Parameter as Parameter
from rom.parametric.parameters import Thickness as Thickness
from rom.parametric.parameters import YoungsModulus as YoungsModulus
from rom.parametric.reduce import reduce_parametric as reduce_parametric
