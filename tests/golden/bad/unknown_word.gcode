; 3:1: unknown word G6 | did you mean G5?
G1 X1 F600
G6
