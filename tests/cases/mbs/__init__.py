"""Mechanisms and bodies with a known motion."""
