"""A real projector and camera: exposed in step, each photo checked before it counts."""
