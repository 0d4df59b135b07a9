"""Sizes, datums and tolerances of a model: the semantic PMI of AP242, read from its text."""
