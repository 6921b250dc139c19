from rom.components.rockfall.impact import Gallery as Gallery
from rom.components.rockfall.impact import Impact as Impact
from rom.components.rockfall.impact import Slab as Slab
from rom.components.rockfall.impact import sensitivity as sensitivity
from rom.components.rockfall.impact import strike as strike
from rom.components.rockfall.laws import Cushion as Cushion
from rom.components.rockfall.laws import CushionForce as CushionForce
from rom.components.rockfall.laws import Shear as Shear
