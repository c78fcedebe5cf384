"""An independent judge of the promise: parses the written NC text, follows its motion, measures it against the CL path.

Nothing in here imports the smoothing, the writers or the verification of the package under test. Slow and plain on
purpose: what these modules say must be obvious from their text and from `tests/test_oracle.py`.
"""
