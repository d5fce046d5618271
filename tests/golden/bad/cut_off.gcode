; 3:8: the file ends inside line 3 | it may have been cut off: export it again, or end the last line with a line end
G1 X1 F600
G1 X12.