"""Wheels whose blades differ.

`substructured_sector` reduces one and what is left, `disk` the rest without blades; `bladed_wheel`
puts any together, `mistuning` varies them a little.
"""
