"""Lumped models: the rigid twin with one degree of freedom, event-driven and compiled."""
