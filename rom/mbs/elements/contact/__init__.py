"""Contact of bodies: the laws of `impact`, bodies of simple shape in `points`, `surfaces`.

What touches is pushed apart by a force that grows with the depth of penetration; none pulls.
`capsules` touch where `segments`, their axes, are nearest; `bristles` let friction hold.
"""
