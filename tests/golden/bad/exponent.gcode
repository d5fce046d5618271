; 2:7: Y1e-05: exponents are not allowed | write Y0.00001, or a space before e if that is a word of its own
G1 X1 Y1e-05 F600
