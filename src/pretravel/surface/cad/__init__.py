"""Parts from STEP files: faces as surfaces, with their edges.

step_reader lets the CAD kernel read a file in a process of its own (step_to_brep); brep and
brep_geometry read the kernel's text form; step_part makes a part of faces from it, with boundary
and trim for the edges.
"""
