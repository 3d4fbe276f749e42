"""Places of the parameters in the flat vector that the compiled kernels read."""

KM, JU, TSU, DTSU, BU, DBU, JL, KTHETA, TSL, T1, T2, BETA1, BETA2, BL = range(14)
N_PARAMETERS = 14
LAW, CLAMP, LOCKED = 14, 15, 16
# Reciprocals: a division costs as much as a quarter of the friction law.
PER_JU, PER_JL = 17, 18
SIZE = 19

NAMES = (
    "km",
    "Ju",
    "Tsu",
    "dTsu",
    "bu",
    "dbu",
    "Jl",
    "ktheta",
    "Tsl",
    "T1",
    "T2",
    "beta1",
    "beta2",
    "bl",
)
