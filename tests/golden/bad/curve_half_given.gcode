; 2:8: G5 has I alone | give I and J both, or neither to go on from the G5 before
G5 X10 I5 P-5 Q0 F600
