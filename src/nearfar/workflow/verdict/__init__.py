"""How far a transport can be trusted, by photos that its estimate never saw."""
