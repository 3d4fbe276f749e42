"""Compiled encoders, filters and observations of one environment."""

from math import floor

from drill_env._jit import entry, inlined, kernel
from drill_env.environment._records import VIEW_STATE, VIEW_SURFACE
from drill_env.sensors.kernels import filter_step, lost_counts, quantise, start_filter


@entry
def spoil(row, disc, seen, draw, setting):
    """Angle with the noise and the missed counts of one random draw, as `read_encoder` has them."""
    seen += setting.noise_rad * draw[disc]
    if setting.missed > 0.0 and setting.quantum > 0.0:
        moved = floor(seen / setting.quantum + 0.5)
        moved -= floor((row.measured[disc] + row.lost[disc]) / setting.quantum + 0.5)
        row.lost[disc] += setting.quantum * lost_counts(moved, setting.missed, draw[2 + disc])
    return seen - row.lost[disc]


@inlined
def delay_samples(row, ring, out, samples):
    """Put the exact angles of one period into the ring; leaves the late ones in `out`."""
    length, head, delay = ring.shape[0], row.head, row.delay
    for j in range(samples):
        head = head + 1 if head + 1 < length else 0
        ring[head, 0], ring[head, 1] = out[j, 0] + out[j, 3], out[j, 3]
        late = head - delay if head >= delay else head - delay + length
        out[j, 0], out[j, 1] = ring[late, 0], ring[late, 1]
    row.head = head


@inlined
def read_samples(row, ring, noise, out, setting):
    """Pass the encoder samples of one period through delay, noise, counts and filter."""
    delay_samples(row, ring, out, setting.samples)
    for disc in range(2):
        # Local copies: through memory each sample would wait for the one before.
        last, z1, z2 = row.memory[disc, 0], row.memory[disc, 1], row.memory[disc, 2]
        speed = row.speed[disc]
        for j in range(setting.samples):
            seen = out[j, disc]
            if noise.shape[0] > 0:
                seen = spoil(row, disc, seen, noise[row.noise_row, j], setting)
            seen = quantise(seen, setting.quantum)
            row.measured[disc] = seen
            speed, z1, z2 = filter_step(last, z1, z2, seen, setting.rate, setting.b, setting.a)
            last = seen
        row.memory[disc, 0], row.memory[disc, 1], row.memory[disc, 2] = last, z1, z2
        row.speed[disc] = speed


@kernel
def start_sensors(row, ring, setting, error_u, error_l):
    """Encoders and filters as if the discs had turned steadily, with such errors, before."""
    length, y = ring.shape[0], row.run.y
    row.head = length - 1
    for k in range(length):
        age = (length - 1 - k) / setting.rate
        ring[k, 0] = y[0] + y[3] - age * y[1] + error_u
        ring[k, 1] = y[3] - age * y[2] + error_l
    for disc in range(2):
        row.lost[disc] = 0.0
        row.speed[disc] = y[1 + disc]
        row.measured[disc] = quantise(ring[length - 1 - row.delay, disc], setting.quantum)
        start_filter(row.memory[disc], row.measured[disc], y[1 + disc], setting.b, setting.a)


@inlined
def clip(value, bound):
    """`value` within +- `bound`."""
    return min(max(value, -bound), bound)


@inlined
def fill_frame(row, setting, out):
    """Write the present measurements, clipped to their bounds."""
    bounds = setting.bounds
    if setting.shown == VIEW_SURFACE:
        out[0] = clip(row.speed[0], bounds[0])
        return
    y = row.run.y
    if setting.shown == VIEW_STATE:
        out[0], out[1] = clip(y[0], bounds[0]), clip(y[1], bounds[1])
        out[2] = clip(y[2], bounds[2])
    else:
        out[0] = clip(row.measured[0] - row.measured[1], bounds[0])
        out[1], out[2] = clip(row.speed[0], bounds[1]), clip(row.speed[1], bounds[2])


@inlined
def fill_observation(row, fresh, setting, out):
    """Observation: measurements, set point, voltage, then past frames, newest first."""
    n = 1 if setting.shown == VIEW_SURFACE else 3
    frame = n + 1
    past = (out.size - n - 2) // frame
    if not fresh:
        for k in range(past - 1, -1, -1):
            to = n + 2 + k * frame
            source = 0 if k == 0 else to - frame
            for j in range(n):
                out[to + j] = out[source + j]
            out[to + n] = out[n + 1] if k == 0 else out[source + n]
    fill_frame(row, setting, out)
    out[n], out[n + 1] = row.setpoint, row.voltage
    if fresh:
        for k in range(past):
            to = n + 2 + k * frame
            for j in range(n):
                out[to + j] = out[j]
            out[to + n] = out[n + 1]
