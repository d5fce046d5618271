; 2:1: the curve's control points are 400 m apart | curves may be 100 m long; I J and P Q count from the start and the end
G5 X10 I100000 J0 P-100000 Q0 F600
