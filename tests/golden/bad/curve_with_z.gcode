; 2:12: G5 has no word Z: curves lie in the XY plane | move Z in a line of its own, or draw a helix with G2 or G3
G5 X10 Y10 Z1 I5 J0 P-5 Q0 F600
