"""What the process of a cell is given in tests: a module that is imported at once."""

import os
import time


def eat(gigabytes: float) -> None:
    eaten = bytearray(int(gigabytes * 1e9))
    for at in range(0, len(eaten), 4096):
        eaten[at] = 1
    time.sleep(60)


def die(number: int) -> None:
    os.kill(os.getpid(), number)


def refuse(text: str) -> None:
    print("what libraries print does not come between")
    raise ValueError(text)
