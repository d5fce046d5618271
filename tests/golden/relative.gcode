; Relative distances and offsets: G91 leaves E alone, G92 alone means zeros.
M83
G91
G1 X10 Y5 E2 F600
G1 X-10 E1
G92
G90
G1 X3 E1
G92 X100 Z-2
G1 X99 Z-2.5
M82
G92 E10
G1 X98 E12
G1 E11
G1 X97
G1 E15
