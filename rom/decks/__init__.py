"""Input decks of other programs, read card by card.

`lines` follows includes, reads numbers and refuses by name what is not read; `bulk` knows the cards
of Nastran, `keywords` the blocks of Abaqus and CalculiX, `nodes` their nodes, `systems` the axes of
coordinates. What else the cards mean is for `rom.fe.mesh.sources` and `rom.io.matrices` to say.
"""
