; The shape of a PrusaSlicer file: start code, layers, retraction, end code.
M73 P0 R10
M201 X9000 Y9000 Z500 E10000 ; sets maximum accelerations, mm/sec^2
M107
M190 S40
M104 S0
;TYPE:Custom
G28 ; home all axes
G1 Z5 F5000 ; lift nozzle
G21
G90
M82
G92 E0
;LAYER_CHANGE
;Z:2.5
;HEIGHT:2.5
G1 Z2.5 F3600
G1 E-20 F2400
G1 X120 Y-10
G1 E0
;WIDTH:5
G1 F1200
G1 X140 Y-10 E250
G1 X140 Y10 E500.5
G92 E0
G1 E-20 F2400
;LAYER_CHANGE
;Z:5
G1 Z5 F7200
G1 E0 F2400
G1 X120 Y10 E250 F1200
M107
G28 X0 Y0
M84     ; disable motors
