"""One reduction for a range of parameters: materials and thicknesses of regions."""
