"""Wheels whose blades differ.

`blade` reduces one, `substructured_sector` what is left, `disk` the rest without blades, as
`records`; `bladed_wheel` puts any together, `mistuning` varies them a little.
"""
