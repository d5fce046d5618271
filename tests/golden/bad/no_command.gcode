; 2:1: X without a command | begin the line with G1
X10 Y5
