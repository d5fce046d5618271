; 2:14: checksum *70 does not fit the line | it would be *62: the line was damaged
N12 G1 X1 Y5 *70
