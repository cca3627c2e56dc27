"""What to play: advice, the information of every step, and the protocol that tells most."""
