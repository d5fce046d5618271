; 3:1: G5.1 lies in the XY plane only | write G17 before G5.1
G19
G5.1 X10 I5 J5 F600
