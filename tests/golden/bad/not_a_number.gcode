; 2:4: Xnan is not a number | give a number
G1 Xnan F600
