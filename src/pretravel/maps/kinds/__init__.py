"""The kinds of map, one file each: functions, fit, form in files, form on controls.

A kind is two classes: a `KindOfMap`, which is its fit, and a `MapBasis`, which is its functions.
`pretravel.identification.kind_registry` lists all kinds. The kind ``physical`` needs the physics of
the probe: `pretravel.identification.physical`.
"""
