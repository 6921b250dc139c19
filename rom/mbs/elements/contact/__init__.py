"""Contact of bodies: the laws of `impact`, simple `shapes` that touch, and how in `points`.

What touches is pushed apart by a force that grows with the depth of penetration; none pulls.
"""
