"""What drives the agent core: live, in lockstep, in replay."""
