"""What is pressed together: metals, moduli, hardness, conductivities."""
