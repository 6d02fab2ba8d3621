"""Places in a contact law's block, whose layout `core/mbma.h` describes, for the Python that fills blocks in."""

DEGREE = 8
CENTRE, RATE, FORCE_AT, AREA_AT, ENERGY_AT = 0, 1, 2, 3 + DEGREE, 4 + 2 * DEGREE  # in a record
RECORD = 5 + 2 * DEGREE
# quantities, by which questions name them
QUANTITIES = ("force", "area", "stiffness", "area_slope", "energy")
FORCE, AREA = range(2)

# words of the head
(
    H_MAX, SCALE, LOW, HIGH, PLUS, MINUS, KINK_SIGN, KINK, KINK_SIGN_2, KINK_2, POWER_F, POWER_A, LOWEST, HIGHEST,
    EXPONENT, MINUS_ROWS, RECORDS, ENDS,
) = range(18)  # fmt: skip
HEAD = 18

INVERSE_DEGREE = 5
INVERSE_BITS = 2  # of the mantissa: 4 buckets an octave of force or area
INVERSE_RECORD = 3 + INVERSE_DEGREE + 1
INVERSE_HEAD = 6
Y_LEAST, Y_LOW, Y_HIGH, Y_TURN, FIRST_BUCKET, END = range(INVERSE_HEAD)
