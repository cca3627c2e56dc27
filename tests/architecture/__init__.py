"""Does the house stand as drawn: who imports whom, what stays small, what stays cheap to start?"""
