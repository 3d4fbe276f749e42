"""Types of what is compiled alone, and how kernels call it by its address in the tableau."""

from numba import float64, from_dtype, int64, types
from numba.core.typing.templates import signature

from drill_env._jit import caller
from drill_env.integrator._records import EVENT, RUN, TABLEAU, WORK
from drill_env.parameters._record import PARAMETERS

_RECORDS = tuple(from_dtype(kind) for kind in (PARAMETERS, RUN, WORK, TABLEAU))


def _read(dimensions: int) -> types.Array:
    # A table's column may come as a read-only array.
    return types.Array(float64, dimensions, "C", readonly=True)


STEP = signature(float64, *_RECORDS, float64)
"""Fill the stages of a step of so many seconds; returns its scaled error."""

FILL = signature(types.none, *_RECORDS, float64)
"""Work on the stages of such a step: dense output or sensitivities."""

ADVANCE = signature(
    int64, *_RECORDS, _read(1), _read(2), _read(1), float64[:, ::1], int64[:, ::1],
    types.Array(from_dtype(EVENT), 1, "C"), float64[:, :, ::1],
)  # fmt: skip
"""See `_advance.advance`."""

call_step, call_fill, call_advance = caller(STEP), caller(FILL), caller(ADVANCE)
