"""Diagnosis of spoilt photos, by their fit to the transport that was estimated from them."""
