"""Files that controls, CMMs and CAM systems write about touches, one module for each format.

`pretravel.files.format_registry` lists all formats.
"""
