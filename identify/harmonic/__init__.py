"""What harmonics tell of G1 and G2: the paper's second stage, points without a rational form, what is left open."""
