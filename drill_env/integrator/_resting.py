"""Compiled judgement of a disc at rest: what holds it, and to which side it leans.

Friction and effects may differ on both sides of rest, so both are asked.
"""

from drill_env._jit import kernel
from drill_env.effects.signal import entry_at
from drill_env.integrator.records import FIRST_SWITCH, LOWER, N_STATE, UPPER


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
def keep_side(work, row, place):
    """Rates of the inner states and the switches' functions with the discs at rest on one side."""
    for r in range(work.inner):
        work.kz_sides[place, r] = work.k[row, N_STATE + r]
    for j in range(work.switches):
        work.gap_sides[place, j] = work.gaps[row, FIRST_SWITCH + j]


@kernel
def settle_sides(run, work, row):
    """What an effect with memory does at a disc at rest is between what it does on both sides.

    Else its rates would jump where the disc comes to lean the other way, and a memory slide along
    there. Its switches go with its rates: a motor behind its gear leaves where it speeds up.
    """
    for i in range(work.acting):
        e = entry_at(work.effects, i)
        disc = UPPER if e.upper else LOWER
        if run.mode[disc] == 0 and not e.idle and e.states > 0:
            share = lean(run, work, disc)
            for r in range(e.first_state, e.first_state + e.states):
                back, ahead = work.kz_sides[0, r], work.kz_sides[1, r]
                work.k[row, N_STATE + r] = back + share * (ahead - back)
            for j in range(e.first_switch, e.first_switch + e.switches):
                back, ahead = work.gap_sides[0, j], work.gap_sides[1, j]
                work.gaps[row, FIRST_SWITCH + j] = back + share * (ahead - back)
