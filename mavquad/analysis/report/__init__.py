"""The report of a flight or of any log: one HTML page, a figure, a summary, and columns for other programs."""
