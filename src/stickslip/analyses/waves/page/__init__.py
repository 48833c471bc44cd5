"""Waves on the page: modes, Campbell diagrams, flutter, safe speeds."""
