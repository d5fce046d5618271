; Cubic and quadratic curves, one after the other, with clay and air, in inches; blending.
G64 P0.5
G5 X1 Y1 I0 J3 P0 Q-3 F600
M105
G5 X2 P0 Q-3 E2
G5.1 X6 I2 J-9 F1200
G61
G91
M220 S50
G5 X10 Y0 I5 J5 P-5 Q5 E3
G61.1
G92 X0 Y0
G90
G20
G64 P.01
G5.1 X1 I.3 E.5
M3 S255
G5 X2 Y0 I0 J1 P0 Q1
M5
G64
G5 X2 I0 J0 P0 Q0
G5 X2 I0 J0 P0 Q0 E.6
