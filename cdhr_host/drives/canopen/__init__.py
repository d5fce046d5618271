"""The CANopen master: six CiA 402 axes and one CiA 401 coupler, one thread, no waiting for others."""
