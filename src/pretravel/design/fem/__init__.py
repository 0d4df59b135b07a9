"""The moving part of a probe in finite elements, and its condensation."""
