"""The probe as described: geometry, materials, catalogue."""
