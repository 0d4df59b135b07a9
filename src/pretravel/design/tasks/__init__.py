"""Tasks of the design of probes."""
