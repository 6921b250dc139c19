"""The command line: one module per verb, each of which loads what it needs when it runs."""
