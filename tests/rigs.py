"""Which simulated rigs do the device tests play?"""

QUIET = """
spec: 1
rig: op-amp circuit without noise
G1: {num: [1000], den: [1.0e-4, 20, 1000]}
F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}}
G2: {num: [1000], den: [1.0e-6, 2, 1000]}
"""

GAP = """
spec: 1
rig: a circuit with a gap
G1: {num: [1], den: [0.002, 1]}
F: {backlash: {S_L: 2, D_L: 0.5 V, S_U: 2, D_U: -0.5 V}}
G2: {num: [1], den: [0.001, 1]}
noise: 5 mV
"""

GAIN = """
spec: 1
rig: an amplifier of gain 3 and nothing else
G1: {num: [1], den: [1]}
F: {linear: {gain: 3, offset: 0 V}}
G2: {num: [1], den: [1]}
"""

CABLE = """
spec: 1
rig: a cable
G1: {num: [1], den: [1]}
F: {linear: {gain: 1.003, offset: 2 mV}}
G2: {num: [1], den: [2.0e-4, 1], dead_time: 237 us}
noise: 1 mV
"""
