"""Of a recording too long to be explained whole: which stretches stand for it, and does what they tell hold for all?"""
