"""Measurement uncertainty: the GUM, Monte Carlo, covariances, and least-squares features."""
