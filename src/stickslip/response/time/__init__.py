"""Motion in time: integration, shooting, Floquet multipliers."""

from stickslip.contact.cache import allow_no_cache

allow_no_cache()  # before any function is compiled
