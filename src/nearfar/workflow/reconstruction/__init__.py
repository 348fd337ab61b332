"""From a capture to a transport: one job, in tiles of camera rows."""
