"""What is done in the phases of a flight, one part a file; the captain takes the flight from one to the next."""
