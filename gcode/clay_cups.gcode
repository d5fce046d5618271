; cdhr calibrate clay --profile paper-wide --material stoneware --by cups --pattern clay_cups.gcode : weigh every cup
G21 ; millimetres
G90 ; absolute
M82 ; absolute E
G92 E0
G0 Z100 F3000
M0 cup 1 of 8: 93.9 kPa for 60 s
G92 E0
G1 E780.14406 F780.14406 ; 13.0 mm3/s expected
M0 cup 2 of 8: 108 kPa for 60 s
G92 E0
G1 E3126.30839 F3126.30839 ; 52.1 mm3/s expected
M0 cup 3 of 8: 119.2 kPa for 60 s
G92 E0
G1 E7035.46096 F7035.46096 ; 117.3 mm3/s expected
M0 cup 4 of 8: 128.8 kPa for 39 s
G92 E0
G1 E8093.85998 F12452.09227 ; 207.5 mm3/s expected
M0 cup 5 of 8: 137.5 kPa for 25 s
G92 E0
G1 E8111.56048 F19467.74515 ; 324.5 mm3/s expected
M0 cup 6 of 8: 145.5 kPa for 17 s
G92 E0
G1 E7948.13272 F28052.23313 ; 467.5 mm3/s expected
M0 cup 7 of 8: 153 kPa for 13 s
G92 E0
G1 E8290.31301 F38262.9831 ; 637.7 mm3/s expected
M0 cup 8 of 8: 160 kPa for 10 s
G92 E0
G1 E8323.30907 F49939.85439 ; 832.3 mm3/s expected
M0 weigh the last cup
G0 Z100 F3000
G28 ; back to the reference, above the clay
M84 ; cables stay taut
