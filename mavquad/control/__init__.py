"""The paper's law, one idea a file; pure functions over frozen dataclasses, plain floats."""
