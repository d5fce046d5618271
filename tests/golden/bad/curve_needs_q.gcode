; 2:3: G5 needs Q | G5: cubic curve in XY: I J from the start to the first control point, P Q from the end to the second
G5 X10 I5 J0 P-5 F600
