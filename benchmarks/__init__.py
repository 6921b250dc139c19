"""Benchmarks: ratios measured in one run.

`timing` is the clock, `models` are the components, `units` a gear unit for two programs,
`two_stages` one of solids, `gears` a planetary train, `oil_films` a bearing, `loops`, `wheel`,
`updating` and `large_deflection` large measurements, `starts` what compiles when it
is used first, `peers` the other programs; `benchmarks` lists them all for ``rom bench``.
"""
