; 2:1: unsupported word G5.2 | of the curves only G5 and G5.1 are there: write NURBS as cubics (G5)
G5.2 P1 L3
