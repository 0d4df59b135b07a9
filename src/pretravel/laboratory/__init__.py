"""The calibration laboratory: rig, separation of machine and probe, standards, certificate."""
