; 4:1: no speed has been given yet | give the first G1 an F in units per minute, such as F1200
G28
G0 X1
G1 X2
