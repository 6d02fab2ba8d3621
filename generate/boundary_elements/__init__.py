"""Simulations by boundary elements: the evidence that the calibrated law is fitted to and tested on."""
