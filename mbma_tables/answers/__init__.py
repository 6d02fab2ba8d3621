"""`contact`, its result, leakage, sensitivity; units, shapes, checks."""
