"""Surfaces of parts: geometry alone, below both branches.

local_geometry (the protocol) ← shapes, parametric, spline, swept (with curves): the surfaces;
brep, trim, cad (with step_to_brep): faces of STEP files; contact, search: where a ball touches;
inspection: where to touch; specification: all of them from words.
"""
