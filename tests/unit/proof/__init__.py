"""Is the independent integrator right, and is it independent?"""
