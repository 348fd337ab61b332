"""What can be wrong with the photos of a capture: found, worded and kept here alone.

Each fault is a frozen record whose text is one sentence: what is wrong, how bad it is, and the
cure. A capture keeps the sentences. Photos that cannot be used at all are no faults of a capture:
`nearfar.capture.checks` refuses them.
"""
