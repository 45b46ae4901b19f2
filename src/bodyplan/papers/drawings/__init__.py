"""Figures of the papers, drawn again from what bodyplan computes."""
