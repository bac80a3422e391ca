"""What is done to streams before a filter sees them: clocks shifted, counters unwrapped, readings filtered, streams joined.

Functions of streams and plain numbers. Values may have leading axes (runs of a Monte Carlo), which share the stamps: which rows
there are never depends on a reading. What is lost, put in or doubtful is an event; a reading that cannot be had is NaN.
"""
