"""Set-valued friction of both discs."""

from drill_env.friction.laws import (
    kernel_record,
    lower_curve,
    lower_curve_derivatives,
    lower_curve_slope,
    lower_torque_set,
    negative_range,
    upper_torque_set,
)

__all__ = [
    "kernel_record",
    "lower_curve",
    "lower_curve_derivatives",
    "lower_curve_slope",
    "lower_torque_set",
    "negative_range",
    "upper_torque_set",
]
