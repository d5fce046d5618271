; 2:11: G1 has no word K | known: X Y Z E F
G1 X1 Y2 	K3 F600
