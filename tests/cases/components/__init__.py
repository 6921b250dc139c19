"""Cases of components that several files test."""
