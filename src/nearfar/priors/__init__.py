"""What rows of a transport are expected to be before any photo."""
