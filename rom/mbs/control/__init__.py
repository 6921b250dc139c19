"""A mechanism that another program moves step by step.

`variables` are its inputs and outputs by name, `stepper` takes the steps.
"""
