"""What gives, model by model: analytic, finite elements, and published closed forms."""
