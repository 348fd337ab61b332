"""Rival and reference ways to acquire transport, to compare against on equal terms."""
