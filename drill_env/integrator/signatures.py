"""Types of what is compiled alone, and how kernels call it by its address in the tableau."""

from numba import float64, from_dtype, int64, types
from numba.core.typing.templates import signature

from drill_env._jit import caller
from drill_env.integrator.records import RUN, TABLEAU, WORK
from drill_env.parameters.record import PARAMETERS

_RECORDS = tuple(from_dtype(kind) for kind in (PARAMETERS, RUN, WORK, TABLEAU))

STEP = signature(float64, *_RECORDS, float64)
"""Fill the stages of a step of so many seconds; returns its scaled error."""

FILL = signature(types.none, *_RECORDS, float64)
"""Work on the stages of such a step: dense output or sensitivities."""

ADVANCE = signature(int64, *_RECORDS)
"""See `_advance.advance`."""

RATES = signature(types.none, *_RECORDS[:3], int64, float64, float64)
"""Rates and event functions of a rig with effects, for the state in a row at a time (s)."""

STAGE = signature(types.none, *_RECORDS, float64, int64, float64)
"""The same for a stage of a step of so many seconds, under a voltage (V)."""

GAP = signature(float64, *_RECORDS, float64, float64, int64)
"""Event function at a share of a step."""

CHANGE = signature(int64, *_RECORDS, int64, float64)
"""Pass an event under a voltage (V); returns its kind."""

call_step, call_fill, call_advance = caller(STEP), caller(FILL), caller(ADVANCE)
call_rates, call_stage, call_gap = caller(RATES), caller(STAGE), caller(GAP)
call_change = caller(CHANGE)
