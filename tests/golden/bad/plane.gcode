; 3:1: G3 has no word J in the plane of G18 | the centre is I K there
G18
G3 X10 Z5 J5 F600
