; 2:1: G3 has no centre | give I and J, from the start to the centre, or R
G3 X5 F600
