; 2:7: Y has no number | write Y0 or leave it out
G1 X1 Y F600
