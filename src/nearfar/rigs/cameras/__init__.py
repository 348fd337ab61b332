"""Real cameras: a small driver for each kind over one base class."""
