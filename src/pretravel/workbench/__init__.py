"""The workbench: the jobs of pretravel as a local page in the browser."""
