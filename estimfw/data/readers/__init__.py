"""Readers of files of numbers, for every source that reads one.

They are strict: what cannot be read with certainty is a `DataError` with the file, and the line where there are lines. A
missing number stays NaN; what is to become of it is the source's business.
"""
