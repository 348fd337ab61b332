"""What another package adds to nearfar, one of each."""
