"""Compiled loops of identification: what a search asks for thousands of times."""
