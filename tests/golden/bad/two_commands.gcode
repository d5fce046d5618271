; 2:5: two commands in a line: G90 and G21 | one command per line
G90 G21
