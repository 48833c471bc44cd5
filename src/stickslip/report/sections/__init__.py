"""Sections of the analyses, one a file; `stickslip.report.page` lists them."""
