"""Files that describe components and mechanisms (TOML), with units, checked by one table.

`document` knows the lines of a file, `keys` what a table of keys says of it, `declared` makes such
a table of signatures; `component` and `mechanism` read by those of `component_keys` and
`mechanism_keys`, with `methods` and `laws` by name; `mechanism_fmu` packs a mechanism with its
bodies, `page` is their documentation, `examples` come with rom. In mechanism files, `expressions`
reads formulas, `python_files` runs functions if they are trusted, `connections` calls the methods.
"""
