"""Files that controls and their senders write about touches, one module for each format.

``FORMATS`` in ``files/format_registry.py`` lists them.
"""
