"""The one exception by which mechanics says that numerics failed (exit code 3 on the command line)."""

from __future__ import annotations


class NumericsFailed(RuntimeError):
    """A computation cannot go on. Says what failed, where, at which step, and what to change.

    Parameters
    ----------
    what : the quantity that failed and by how much, e.g. ``"energy error 4.1 % (limit 3 %)"``
    where : the block, element or particle concerned, if known
    step : the step at which it was noticed, if stepping
    advice : what a user can change in the scene
    """

    def __init__(self, what: str, *, where: str = "", step: int | None = None, advice: str = "") -> None:
        self.what, self.where, self.step, self.advice = what, where, step, advice
        parts = [what]
        if where:
            parts.append(f"at {where}")
        if step is not None:
            parts.append(f"in step {step}")
        text = " ".join(parts)
        super().__init__(f"{text}; {advice}" if advice else text)
