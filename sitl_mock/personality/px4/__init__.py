"""PX4's manners: releases 1.13, 1.15 and 1.16."""
