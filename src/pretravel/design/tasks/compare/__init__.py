"""Compare the designs of two probes."""
