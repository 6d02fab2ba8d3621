"""A contact law: one surface and theory as polynomials of the gap."""
