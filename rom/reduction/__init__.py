"""Reduction: `bases` of shapes, on `interfaces` of a kind."""
