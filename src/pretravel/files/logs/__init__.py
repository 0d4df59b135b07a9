"""Files that CMMs and CAM systems write about touches, one module for each format.

The group of entry points ``pretravel.formats`` lists all formats.
"""
