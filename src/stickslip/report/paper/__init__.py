"""Figures of the page for print, drawn by matplotlib, which is imported only when needed."""
