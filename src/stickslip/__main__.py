"""``python -m stickslip``."""

from stickslip.cli import main

if __name__ == "__main__":
    main()
