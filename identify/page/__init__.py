"""What an operator reads: pages and pictures."""
