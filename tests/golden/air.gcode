; Pneumatic clay: the air opens and closes by words, with dwells, and no E at all.
G0 X100 Z2
M3 S127.5
G4 P450
G1 X200 F1200
G3 X100 Y100 I-100
M5
G4 S0.25
G0 X300
M126
G1 Y200
M127
M106 S255
G1 Y100
M400
M0 refill the clay
M2
G1 X0
