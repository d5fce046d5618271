; cdhr generate ring --diameter 150 --layers 2 --bead 5 --layer-height 2.5 --speed 20 : the paper's double-layer ring
; bead 5 x 2.5 mm, 5258.4 mm3 of clay a layer
; E in mm3, which is mm of a filament of 1.1284 mm
G21 ; millimetres
G90 ; absolute
M82 ; absolute E
G92 E0
G0 Z10 F3000
G0 X75 Y0
;LAYER:0
G0 Z2.5 F3000
G92 E0
G3 X0 Y75 I-75 J0 E1314.60791 F1200
G3 X-75 Y0 I0 J-75 E2629.21582 F1200
G3 X0 Y-75 I75 J0 E3943.82373 F1200
G3 X75 Y0 I0 J75 E5258.43164 F1200
;LAYER:1
G0 Z5 F3000
G92 E0
G3 X0 Y75 I-75 J0 E1314.60791 F1200
G3 X-75 Y0 I0 J-75 E2629.21582 F1200
G3 X0 Y-75 I75 J0 E3943.82373 F1200
G3 X75 Y0 I0 J75 E5258.43164 F1200
G0 Z15 F3000
G28 ; back to the reference, above the clay
M84 ; cables stay taut
