; 3:1: the arc's radius is 10.0000 mm at its start and 10.1000 mm at its end | they may differ by 0.05 mm; I and J count from the start, also after G90
G1 X10 F600
G3 X0 Y10.1 I-10
