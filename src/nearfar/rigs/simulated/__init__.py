"""A simulated projector and camera before a transport that is known."""
