"""The law of Kim, Pyrkin, Borisov (arXiv:2605.14945), one idea a file; pure functions over frozen dataclasses, plain
floats."""
