"""PX4's manners: releases 1.13 to 1.17."""
