"""The screen of a part."""
