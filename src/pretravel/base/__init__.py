"""What every room stands on: numbers, units, errors, directions, frames, whole files."""
