"""Recursions on plain arrays. Textbook letters: P, Phi, Q, H, R, K, U, D.

Every NumPy function takes leading axes (runs, bank members); the last axes are the states'. Scalar measurements in sequence.
"""
