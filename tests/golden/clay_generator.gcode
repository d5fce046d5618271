; The shape of a FullControl file for a clay printer: priming at rest, F before X, E0 on travel, relative E.
G21 ; set units to millimeters
G28 ; home axes
G90 ; absolute coordinates
M83
M220 S50
M221 S110
G1 F3600 X0 Y-90 Z50 E0
G1 F120 E300
G1 F250 Z100 E0.5
G1 F3600 X60 Y0 Z2.5 E0
G1 F1200 X60.526644 Y3.967126 Z2.528074 E6.627915
G1 X60.720836 Y7.99405 Z2.560056 E-2
G1 X60.518223 Y12.037823 Z2.595487 E6.7
G28 ; home axes
