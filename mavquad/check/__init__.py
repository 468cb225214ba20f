"""`mavquad check`: who is there, what arrives, and what may be flown; nothing is changed but rates on our own link."""
