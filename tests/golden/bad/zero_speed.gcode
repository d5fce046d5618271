; 2:7: F0 is no speed: it must be above 0 | F is in units per minute, such as F1200
G1 X1 F0
