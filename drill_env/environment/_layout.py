"""Places in the flat arrays that hold one environment per row."""

TWIST, OMEGA_U, OMEGA_L, THETA_L = 0, 1, 2, 3
STEP_SIZE, VOLTAGE, SETPOINT = 4, 5, 6
MEMORY_U, MEMORY_L = 7, 10
MEASURED_U, MEASURED_L, SPEED_U, SPEED_L = 13, 14, 15, 16
LOST_U, LOST_L, FRICTION_FACTOR, MAX_SPEED = 17, 18, 19, 20
N_FLOATS = 21

MODE_U, MODE_L, MODE_CLAMP = 0, 1, 2
STEP, HEAD, DELAY, FRICTION_STEP, LAST_STEP, NOISE_ROW = 3, 4, 5, 6, 7, 8
N_INTS = 9

INFO = (
    "twist",
    "omega_u",
    "omega_l",
    "theta_u",
    "theta_l",
    "friction_torque_u",
    "friction_torque_l",
    "stuck_u",
    "stuck_l",
    "setpoint",
    "voltage",
    "reward_track",
    "reward_error",
    "reward_twist_rate",
    "reward_stick",
    "reward_effort",
)
