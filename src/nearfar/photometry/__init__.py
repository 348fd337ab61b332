"""From photos to measurements."""
