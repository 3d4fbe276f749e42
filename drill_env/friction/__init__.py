"""Set-valued friction of both discs."""

from drill_env.friction.laws import (
    lower_curve,
    lower_curve_slope,
    lower_torque_set,
    negative_range,
    upper_torque_set,
)

__all__ = [
    "lower_curve",
    "lower_curve_slope",
    "lower_torque_set",
    "negative_range",
    "upper_torque_set",
]
