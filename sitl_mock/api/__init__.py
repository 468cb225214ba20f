"""The mock for other people's tests: a vehicle in virtual time, or live on the loopback interface."""
