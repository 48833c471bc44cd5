"""Cache of expensive parts of a model on disk."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

from stickslip.study.store.archive import FORMAT, decode, encode
from stickslip.study.store.atomic_write import write_whole
from stickslip.study.store.progress import LOG


@dataclass(frozen=True, eq=False)
class PartStore:
    """Cache of named arrays, numbers and texts under the hash of their inputs.

    Parameters
    ----------
    folder
        Folder of the files; None: nothing is stored.
    fresh
        Whether files of earlier runs are ignored.
    written
        Files written by this run.
    """

    folder: Path | None = None
    fresh: bool = False
    written: set[Path] = field(default_factory=set)

    def kept(self, content: str, make: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
        """Return the result of `make`, stored or new; `content` is everything that it depends on."""
        if self.folder is None:
            return make()
        named = sha256(f"{FORMAT} {content}".encode()).hexdigest()
        path = self.folder / f"{named}.npz"
        if path.is_file() and (path in self.written or not self.fresh):
            try:
                return decode(path.read_bytes())
            except (ValueError, OSError) as error:
                LOG.info(f"{path} is damaged and made anew ({error})")
        # what is computed and what is read are the same to the last bit, and of the same kinds
        payload = encode(make())
        write_whole(path, payload)
        self.written.add(path)
        return decode(payload)
