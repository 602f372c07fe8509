"""Lumped models of one degree of freedom: the rigid twin, event-driven and compiled; a plastic and a lubricated one."""
