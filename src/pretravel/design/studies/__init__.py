"""Studies: many probes, predicted under many conditions, and what their differences do."""
