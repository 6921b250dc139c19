"""Pictures of curves and plane fields.

`curves` over time and speed, `panels` of small diagrams, `fields` with level curves, `sheets` of
triangles, `things` in space beside them, `updating` of responses before and after, with channels
on a body.
"""
