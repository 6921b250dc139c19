"""Rockfall on a gallery: boulder, cushion, plug and slab, after Schellenberg, Kishi and Kon-No.

Three masses and three springs: the boulder m_1 presses the cushion (1), the cushion a plug m_2 of
cushion and concrete, the plug shears (2) into the slab m_3, which bends (3)::

    m_1 z_1'' = m_1 g - F_1(z_1 - z_2)
    m_2 z_2'' = F_1 - F_2(z_2 - z_3)
    m_3 z_3'' = F_2 - F_3(z_3)

z points down and counts from contact; plug and slab rest in balance with their weight. The modes
of a slab, such as those of a reduced finite element body, can take the place of the last mass:
q'' + 2 zeta omega q' + omega^2 q = phi F_2, z_3 = phi . q.

`laws` has simple laws of cushion and plug, `layer` the cushion as a layer of sand from its
geometry, and which force arrives below it, `impact` the motion and what decides over it,
`calibration` fits parameters to measured histories, `design` says what a gallery bears, `kernels`
are compiled, ahead by `field`. Published tests, and how far they are met: docs/theory/rockfall.md.

Source:
    After Schellenberg, On the design of rockfall protection galleries, ETH Zurich (2009), and
    Schellenberg, Kishi and Kon-No on its use for a large-scale test, of which the abstract alone
    was read. Hertz: Johnson, Contact Mechanics (1985).
"""

from rom.lazy import front

front(__name__)
