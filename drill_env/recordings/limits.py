"""How large a recording may be: every limit of the readers, each with where it comes from.

They hold for what a file unpacks to, not for its size on the disk. Beyond each the reader says so
in one error; none of them is a setting.
"""

MOST_ROWS = 10_000_000
"""Rows, and usual intervals between the first and the last row.

Twice an hour's test at 1 kHz is 7.2 million; the next power of ten. Searches lay a recording on an
even grid of its usual interval: so many places, with the some six arrays of 8 bytes that a Fourier
transform of twice the length needs, are about a gigabyte.
"""

MOST_COLUMNS = 1000
"""Columns. Loggers of whole rigs write some hundreds; the package reads seven."""

MOST_VALUES = 40_000_000
"""Values, rows times columns: time, drive and two angles in the most rows, 320 MB as floats."""

MOST_BYTES = 500_000_000
"""Bytes of a file, packed and unpacked: 12 characters for each of the most values."""

LONGEST_HEADER = 100_000
"""Bytes of a header line: 100 for each of the most columns."""

MOST_MEMORY = 3 * MOST_BYTES
"""Bytes in which a file read apart must fit: packed, unpacked and as sent to the caller."""

READING_SECONDS, READING_RATE = 4, 20_000_000
"""Seconds of CPU for a file read apart, and bytes that earn it one more. Measured: a file of 1 kB
that unpacks to the most values takes 1.5 s, one of 240 MB 5 s."""

JSON_RATE = 7_000_000
"""Bytes of JSON that earn a second of CPU: half of the measured 14 MB a second, a million lines of
four numbers in 5.6 s."""

MOST_PACKED = 1032
"""Bytes that one byte of a gzip file may unpack to: deflate's greatest ratio (zlib, technical
details)."""

LONGEST_READING = 60.0
"""Seconds after which the reading of a file apart is ended on systems that do not count CPU, beside
the seconds of CPU that its size earns."""

SHORTEST_INTERVAL = 1e-6
"""Usual interval in s. Counter cards of drives sample at up to 1 MHz; the most rows are then 10 s,
two swings of the string."""

LONGEST_DURATION = 1e6
"""First to last row in s: the most rows at 10 Hz, slower than which the string's swing of 4 s is
hardly seen; eleven days."""

LARGEST_SPAN = 1e6
"""Way from the least to the largest angle in rad (m of a linear axis): a day and a half at
8.5 rad/s, the fastest set point. Searches by angle bin it within a gigabyte, 26 bins a turn."""

LARGEST: dict[str, tuple[float, str]] = {
    "t": (1e11, "s"),
    "u": (1e5, "V"),
    "torque": (1e7, "Nm"),
    "theta_u": (1e9, "rad"),
    "theta_l": (1e9, "rad"),
    "omega_u": (1e5, "rad/s"),
    "omega_l": (1e5, "rad/s"),
    "load_u": (1e7, "Nm"),
    "load_l": (1e7, "Nm"),
    "bridge": (1.0, "(on)"),
    "added_inertia_u": (1e7, "kg m^2"),
    "added_inertia_l": (1e7, "kg m^2"),
}
"""Largest size of each channel in SI units, and the unit.

A clock may count from 1970, 2e9 s, in milliseconds that were not stated; the next two powers of
ten leave that to the check of the clock, which names the remedy. Drives end at 35 kV
(IEC 60038, medium voltage), the largest mill drives at some 1e7 Nm. 1e9 rad is the last power of
ten at which a double still tells a thousandth of a count of 2^20 a turn. 1e5 rad/s are a million
revolutions a minute, twice the fastest dental and optical spindles. The largest torque takes a
second to change the speed of the largest added inertia by 1 rad/s: what is more hardly moves.
"""
