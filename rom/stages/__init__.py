"""What reductions do, stage by stage: functions that each fill in some of one draft.

`bodies` has those of `rom.reduce`, which `rom.workflow` lists, and `deflection` those in which
large deflection differs; `rom.checks` certifies. Substructures, sectors of wheels and families of
bodies have lists of their own, of these stages and others.
"""
