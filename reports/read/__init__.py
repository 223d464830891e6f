"""The records of a run, and the readers that check them.

Nothing here draws, or writes text for a reader.
"""
