"""Compiled judgement of a disc at rest: what holds it, and to which side it leans.

Friction and effects may differ on both sides of rest, so both are asked.
"""

from drill_env._jit import kernel, placed
from drill_env.effects.signal import ENTRY

entry_at = placed(ENTRY)

UPPER, LOWER = 0, 1


@kernel
def keep_held(work, disc, place, size, pull):
    """What stiction has left (Nm) on one side of a disc at rest, against the pull along it."""
    work.held[disc, place] = size - pull
    work.driving[disc, place] = min(size, 0.0)


@kernel
def choose_push(run, work, disc):
    """Direction in which a disc at rest would leave; returns what stiction has left in it.

    Friction and effects may differ on both sides of rest. Where both drive the disc away, as less
    friction than none does, the pull itself decides.
    """
    back, ahead = work.held[disc, 0], work.held[disc, 1]
    if back < 0.0 and ahead < 0.0:
        back, ahead = back - work.driving[disc, 0], ahead - work.driving[disc, 1]
    run.push[disc] = 1 if ahead <= back else -1
    return min(back, ahead)


@kernel
def lean(run, work, disc):
    """Share (0 to 1) with which a disc at rest leans to its side 1, which it is where it leaves."""
    back, ahead = work.held[disc, 0], work.held[disc, 1]
    if back >= 0.0 and ahead >= 0.0 and back + ahead > 0.0:
        return back / (back + ahead)
    return 1.0 if run.push[disc] == 1 else 0.0


@kernel
def settle_rates(run, work, row):
    """Rates of the inner states between those on both sides of a disc at rest.

    Else they would jump where it comes to lean the other way, and a memory slide along there.
    """
    for i in range(work.acting):
        e = entry_at(work.effects, i)
        disc = UPPER if e.upper else LOWER
        if run.mode[disc] == 0 and not e.idle and e.states > 0:
            share = lean(run, work, disc)
            for r in range(e.first_state, e.first_state + e.states):
                back, ahead = work.kz_sides[0, r], work.kz_sides[1, r]
                work.kz[row, r] = back + share * (ahead - back)
