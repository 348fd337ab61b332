"""Scenes of Mitsuba 3 (the extra ``nearfar[mitsuba]``): any with one projector and one camera.

`load_scene` reads a scene file, `RenderedWorld` photographs it with Mitsuba's own integrator, and
`render_transport` computes its whole transport in one pass. Nothing here loads Mitsuba until one
of them is called.
"""
