; Every motion word in one short program: arcs in three planes, cubic and quadratic curves, exact stops, tolerances.
; Written by hand; 20 mm/s, a bead of 12.5 mm3 for each millimetre where clay flows.
G21
G90
M83
M200 D1
G0 X0 Y-40 Z20 F3000
; arcs: flat with clay, upright without
G17
G3 X40 Y0 I0 J40 E785.4 F1200
G2 X20 Y20 R20 E392.7
G3 X20 Y20 Z24 I-10 J0 E788
G18
G2 X40 Z44 I20 K0
G3 X20 Y10 Z24 K-20
G19
G3 Y30 Z24 J10
G2 Y10 Z24 X16 R10
G17
; a row of cubics and a parabola, with clay
G5 X-20 Y10 I-10 J20 P10 Q-20 E700
G5 X-50 Y20 P10 Q-10 E450
G5.1 X-50 Y-30 I-30 J-25 E700
; exact stops, also at the ends of curves
G61
G1 X-40 Y-30 E125
G1 X-40 Y-40 E125
G5 X-20 Y-40 I5 J-10 P-5 Q-10 E300
G3 X0 Y-40 R10 E392.7
; coarse, fine, and the profile's own
G64 P2
G1 X0 Y-20
G1 X20 Y-20
G1 X20 Y0
G3 X25 Y5 R5
G64 P0.02
G1 X30 Y5 E62.5
G1 X30 Y15 E125
G2 X35 Y20 R5 E98
G64
G1 X35 Y30 E125
G1 X0 Y0
G0 Z0
M2
