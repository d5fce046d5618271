; 2:4: X1,5 is not a number | decimals are written with a point: X1.5
G1 X1,5 F600
