; cdhr calibrate clay --profile paper-wide --material stoneware --by lines --pattern clay_lines.gcode : measure every line's width in its middle
G21 ; millimetres
G90 ; absolute
M82 ; absolute E
G92 E0
G0 Z10 F3000
M117 line 1: 93.9 kPa, 2 mm/s
G0 X-60 Y-60
G0 Z2.5
G92 E0
G1 X60 E780.14406 F120
G0 Z10 F3000
M117 line 2: 108 kPa, 3.8 mm/s
G0 X-60 Y-45
G0 Z2.5
G92 E0
G1 X60 E1645.42547 F228
G0 Z10 F3000
M117 line 3: 119.2 kPa, 8.6 mm/s
G0 X-60 Y-30
G0 Z2.5
G92 E0
G1 X60 E1636.15371 F516
G0 Z10 F3000
M117 line 4: 128.8 kPa, 15.2 mm/s
G0 X-60 Y-15
G0 Z2.5
G92 E0
G1 X60 E1638.43319 F912
G0 Z10 F3000
M117 line 5: 137.5 kPa, 23.8 mm/s
G0 X-60 Y0
G0 Z2.5
G92 E0
G1 X60 E1635.94497 F1428
G0 Z10 F3000
M117 line 6: 145.5 kPa, 34.2 mm/s
G0 X-60 Y15
G0 Z2.5
G92 E0
G1 X60 E1640.48147 F2052
G0 Z10 F3000
M117 line 7: 153 kPa, 46.7 mm/s
G0 X-60 Y30
G0 Z2.5
G92 E0
G1 X60 E1638.67165 F2802
G0 Z10 F3000
M117 line 8: 160 kPa, 60.9 mm/s
G0 X-60 Y45
G0 Z2.5
G92 E0
G1 X60 E1640.0609 F3654
G0 Z10 F3000
G0 Z10 F3000
G28 ; back to the reference, above the clay
M84 ; cables stay taut
