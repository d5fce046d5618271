; Arcs and helices in each plane, by centre and by radius.
G0 X10 Z20
G18
G3 X20 Z10 I0 K-10 F600
G2 X10 Z20 R10
G3 X-10 Y5 Z20 I-10 E5
G19
G2 Y15 Z30 J10 K0
G3 X0 Y15 K-3
G17
G3 X10 Y25 Z31 J10
