"""A probe touches a surface.

tip (the probe as the part sees it) → touching (at once) or slide (step by step), with obstacles
in the way → simulation (what the machine reports).
"""
