from rom.mbs.elements.force_elements import DIRECTIONS as DIRECTIONS
from rom.mbs.elements.force_elements import Bushing as Bushing
from rom.mbs.elements.force_elements import Contact as Contact
from rom.mbs.elements.force_elements import Curves as Curves
from rom.mbs.elements.force_elements import Elements as Elements
from rom.mbs.elements.force_elements import Spread as Spread
