"""What each analysis adds to the page, one file an analysis; `stickslip.report.page` lists them."""
