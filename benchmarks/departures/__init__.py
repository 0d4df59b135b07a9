"""Probes, machines and habits that the models of pretravel do not know, and what `qualify` says.

The physics here is written apart: only `evaluation` and `run` import pretravel, and of it only
what a user calls. Lengths are mm, forces N, angles rad; the field words are those of the package.
"""
