"""Patterns and frequencies."""
