; 2:1: unknown word T1 | this machine has one nozzle: only T0
T1
