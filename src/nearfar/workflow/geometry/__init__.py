"""Where a camera and a projector stand, measured by photos of a checkerboard."""
