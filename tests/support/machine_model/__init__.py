"""A model of a machine under LinuxCNC with a touch-trigger probe, to judge G-code programs.

It is written from LinuxCNC's documentation and from trials with LinuxCNC itself, and it knows
nothing of the programs that it runs:

- `interpreter`, `blocks`, `expressions`, `parameters`, `modes`: G-code as LinuxCNC 2.9 reads it;
- `world`: what is on the table; the tip, the stem and the body of a probe;
- `probe`: the signal of a probe, with its faults;
- `machine`: runs a program and returns a `Trace`;
- `judgement`: the laws of safety, as functions of a trace.
"""
