"""A described probe touches a surface: simulated touches."""
