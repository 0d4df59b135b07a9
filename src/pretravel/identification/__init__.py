"""Where both branches meet: a probe's own numbers from touches or from a measured map."""
