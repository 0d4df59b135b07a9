"""The description of a probe from its map."""
