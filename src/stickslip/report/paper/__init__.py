"""Figures of the page drawn for print, by matplotlib, which is imported only when one is drawn."""
