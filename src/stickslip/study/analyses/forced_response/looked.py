"""Stability examinations of a job, resumed after an interruption."""

from dataclasses import dataclass

from stickslip.study.analyses.analysis import Notes, Pieces
from stickslip.study.analyses.forced_response.points import Accepted
from stickslip.study.analyses.forced_response.problem import STABLE, Question
from stickslip.study.analyses.forced_response.stable import Examined, as_note, examine, from_note
from stickslip.study.store.progress import LOG
from stickslip.units import HZ


@dataclass(eq=False)
class Looked:
    """Examines points in the order in which they are asked for.

    Parameters
    ----------
    question
        Of the case.
    notes
        Of the job.
    count
        Points that were asked for.
    taken
        Those of them that a stopped run had examined.
    """

    question: Question
    notes: Notes
    count: int = 0
    taken: int = 0

    def __call__(self, accepted: Accepted) -> Examined:
        """Return what is found of the stability of a point."""
        name, self.count = f"{STABLE}.{self.count}", self.count + 1
        known, pieces = self.notes.get(name), Pieces(self.notes, name)
        one = from_note(known, accepted.point) if known else examine(self.question, accepted, pieces.keep)
        self.taken += bool(known)
        self.notes.put(name, as_note(one))
        pieces.give_up()
        if pieces.taken:
            self._say(f"{one.omega / HZ:.3f} Hz: {pieces.taken} pieces are taken over from a run that was stopped")
        return one

    def tell(self) -> None:
        """Say how many points were known."""
        if self.taken:
            self._say(f"{self.taken} points that were examined before are taken over from a run that was stopped")

    def _say(self, text: str) -> None:
        LOG.info(f"stability: {self.question.said(text)}")
