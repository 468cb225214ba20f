"""What is made of a flight afterwards: metrics, figures, tables."""
