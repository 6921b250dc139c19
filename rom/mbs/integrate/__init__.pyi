from rom.mbs.integrate.simulation import METHODS as METHODS
from rom.mbs.integrate.simulation import RTOL as RTOL
from rom.mbs.integrate.simulation import simulate as simulate
