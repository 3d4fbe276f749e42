"""Compiled linear laws: one pass over all rigs in each control period."""

from drill_env._jit import entry


@entry
def law_volts(index, error, reference, limit, laws, memory, volts):
    """Clipped voltage (V) of every rig's law.

    Args:
        index: which law each rig follows, shape (n,).
        error: measurements less their references, shape (n, p).
        reference: voltages of the references (V), shape (n,).
        limit: V.
        laws: (f, g, h, m, d) stacked, see `Law`.
        memory: states, shape (n, s).
        volts: to write, shape (n,).
    """
    m, d = laws[3], laws[4]
    for i in range(index.size):
        j = index[i]
        wanted = reference[i]
        for a in range(memory.shape[1]):
            wanted += m[j, a] * memory[i, a]
        for a in range(error.shape[1]):
            wanted += d[j, a] * error[i, a]
        volts[i] = min(max(wanted, -limit), limit)


@entry
def advance_laws(index, error, reference, laws, volts, memory, scratch):
    """Carry the memory of every rig's law over the period in which `volts` were applied."""
    f, g, h = laws[0], laws[1], laws[2]
    states = memory.shape[1]
    for i in range(index.size):
        j = index[i]
        applied = volts[i] - reference[i]
        for a in range(states):
            total = h[j, a] * applied
            for b in range(states):
                total += f[j, a, b] * memory[i, b]
            for b in range(error.shape[1]):
                total += g[j, a, b] * error[i, b]
            scratch[a] = total
        for a in range(states):
            memory[i, a] = scratch[a]
