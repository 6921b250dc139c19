from rom.mbs.integrate.simulation import METHOD_RTOL as METHOD_RTOL
from rom.mbs.integrate.simulation import METHODS as METHODS
from rom.mbs.integrate.simulation import simulate as simulate
