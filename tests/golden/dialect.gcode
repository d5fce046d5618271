; One program in the ways of writing that slicers, clay generators and people use.
G21
g90
G01 X10 Y.5 F1200
G1X-.5Y+3
  G1 F600 X1. Y2 (comment) Z.4 ; and another ( one
G0X5
N12 G1 X6*85
N13 M117 5*3 done*58
G04 P250
M42 P0 S0
