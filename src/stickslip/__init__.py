"""stickslip: vibration of bladed disks coupled by friction joints."""

__version__ = "0.1.0"
