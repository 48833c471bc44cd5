"""What a page shows of waves: modes, Campbell diagrams, flutter, safe speeds."""
