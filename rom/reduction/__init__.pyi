from rom.reduction.bases.assumed import AssumedModes as AssumedModes
from rom.reduction.bases.balanced import BalancedTruncation as BalancedTruncation
from rom.reduction.bases.balanced import (
    second_order_balanced_truncation as second_order_balanced_truncation,
)
from rom.reduction.bases.fixed_interface import craig_bampton as craig_bampton
from rom.reduction.bases.free_interface import FreeFree as FreeFree
from rom.reduction.bases.free_interface import Herting as Herting
from rom.reduction.bases.free_interface import Rubin as Rubin
from rom.reduction.bases.krylov import MomentMatching as MomentMatching
from rom.reduction.bases.method import CraigBampton as CraigBampton
from rom.reduction.bases.method import EnhancedCraigBampton as EnhancedCraigBampton
from rom.reduction.bases.method import Guyan as Guyan
from rom.reduction.bases.method import Method as Method
from rom.reduction.bases.method import WithLoads as WithLoads
from rom.reduction.interfaces.characteristic import Characteristic as Characteristic
from rom.reduction.interfaces.polynomial import FourierLegendre as FourierLegendre
from rom.reduction.interfaces.polynomial import Polynomial as Polynomial
from rom.reduction.interfaces.snapshots import Snapshots as Snapshots
