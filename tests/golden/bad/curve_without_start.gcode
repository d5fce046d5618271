; 4:1: G5 without I and J follows no G5 | give I and J, from the start to the first control point
G5 X10 I5 J0 P-5 Q0 F600
G1 X20
G5 X30 P-5 Q0
