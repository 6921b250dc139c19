"""Pictures of curves and plane fields.

`curves` over time and speed, `panels` of small diagrams, `fields` with level curves, `sheets` of
triangles, `updating` of responses before and after.
"""
