"""Pictures of a log: one pass through it, then as many figures as it has numbers for."""
