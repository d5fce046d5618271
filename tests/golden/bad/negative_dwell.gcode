; 2:4: G4 P-5 is a negative time | P is in ms, S in s
G4 P-5
