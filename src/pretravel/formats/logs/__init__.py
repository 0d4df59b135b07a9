"""What controls and inspection programs write of touches, one file per format."""
