; 3:1: unknown word M1234 | did you mean M204?
G1 X1 F600
M1234
