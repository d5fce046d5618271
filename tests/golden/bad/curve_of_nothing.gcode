; 2:1: G5.1 has no control point | give I and J, from the start to the control point
G5.1 X10 Y10 F600
