; G28 in the middle of a print: up, across, and no way down through the clay.
G0 X50 Y50 Z2
G1 X-50 E400 F1200
G1 X-50 Y-50 Z12 E800
G28
G0 X200
G28 X
