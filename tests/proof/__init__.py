"""Trial data by an integrator that shares no code with the product, so that explaining them proves something.

Nothing here imports identify, rig or drivers (tests/unit/proof/test_independence.py holds that). The whole path is
integrated in continuous time on sub-steps far finer than a sample; the concealed physics is written here from its
own equations, not from the catalogue of effects it is used to test.
"""
