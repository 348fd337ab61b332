"""How long tests wait for what must come."""

# Seconds after which it hangs, on the busiest machine too.
LONGEST_WAIT = 600.0
