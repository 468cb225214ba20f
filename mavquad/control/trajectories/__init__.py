"""Trajectories with four continuous derivatives, one idea a file.

taylor     a polynomial and its derivatives at a moment
step       the step from 0 to 1 with bounded derivatives; the phase of a curve that starts and ends at rest
curves     circle and figure of eight over their phase
spline     a curve through given points, at given times
chain_rule a function of the phase as a function of time
heading    where a curve leads, and its derivatives
along      a curve flown from rest to rest
"""
