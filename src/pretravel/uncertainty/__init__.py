"""Uncertainty: GUM, Monte Carlo, and least-squares features with covariance."""
