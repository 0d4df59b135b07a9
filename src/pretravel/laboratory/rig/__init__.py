"""Calibration rigs: traces, marks, parameters, budget."""
