"""The most that may be asked for, where more could only be a mistake."""

#: Of any seed; larger ones would be drawn from as well, but other programs could not read them back.
MOST_SEED = 2**63 - 1
#: Of noise over the largest reading: beyond this there is nothing left to see.
MOST_NOISE = 10.0
#: Presses of a dataset: files' names count them with nine digits.
MOST_PRESSES = 10**9 - 1
