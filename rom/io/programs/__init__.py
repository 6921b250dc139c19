"""Bodies for other multibody programs, one module each."""
