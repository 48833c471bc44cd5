"""Format a multiplier for messages."""

ROUNDS_TO_ONE = 5e-4  # off 1, below which four digits may say 1


def modulus_text(size: float, error: float = 0.0) -> str:
    """Return a modulus with four digits and its error; beside 1 by how much it is off, since that decides."""
    off = size - 1.0
    text = f"{size:.4g}"
    if 0.0 < abs(off) < ROUNDS_TO_ONE:
        text = f"1 {'-' if off < 0.0 else '+'} {abs(off):.2g}"
    return f"{text} ± {error:.2g}" if error > 0.0 else text
