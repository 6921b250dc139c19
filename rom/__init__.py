"""Reduced-order flexible bodies: finite elements in, floating-frame multibody models out."""
