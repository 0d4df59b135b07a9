"""Least-squares features: plane, sphere, circle and cylinder, with their covariances."""
