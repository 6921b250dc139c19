from rom.components.studies.fit import fit as fit
from rom.components.studies.fitted import Fitted as Fitted
from rom.components.studies.samples import design as design
from rom.components.studies.samples import indices_design as indices_design
from rom.components.studies.study import Indices as Indices
from rom.components.studies.study import Study as Study
from rom.components.studies.study import read_study as read_study
from rom.components.studies.study import study as study
