; 2:12: X is given twice | one of each letter in a line
G1 X1 F600 X2
