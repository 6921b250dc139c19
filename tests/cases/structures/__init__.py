"""Structures whose nodes turn."""
