; 2:1: unsupported word G18 | only G17 is supported so far: arcs lie in the XY plane
G18
