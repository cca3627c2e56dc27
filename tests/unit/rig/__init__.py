"""Does the bench side refuse what it must and keep what it was given?"""
