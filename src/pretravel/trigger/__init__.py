"""From forces on the tip to the trigger: statics, event, prediction."""
