"""Parts from CAD files: faces as surfaces, with their edges.

part_file chooses the reader; step_reader and iges_reader let the CAD kernel read a file in a
separate process (kernel_process, file_to_brep), after step_text corrected its text, and iges_bodies
joins faces to bodies there; brep and brep_geometry read the kernel's text form; step_part makes a
part of faces from it, with boundary and trim for the edges.
"""
