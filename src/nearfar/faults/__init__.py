"""Faults in the photos of a capture: they are found, worded and recorded here alone.

Each fault is a frozen record whose text is one sentence: what is wrong, how bad it is, and the
cure. A capture keeps the sentences. Photos that cannot be used at all are no faults of a capture:
`nearfar.capture.checks` refuses them.
"""
