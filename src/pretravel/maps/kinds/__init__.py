"""The kinds of map, one file each: functions, fit, form in files, form on controls.

The kind ``physical`` needs the physics of the probe: `pretravel.identification.physical`.
"""
