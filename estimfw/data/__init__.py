"""Records, streams, timeline and checks of data.

Time is in s, on one clock. A stamp is the *end* of the sampling interval that its row covers.
"""
