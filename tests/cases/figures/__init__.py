"""Figures as readers see them."""
