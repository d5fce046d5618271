; Arcs by centre and by radius, helices, full circles, inches, relative distances.
G0 X100 Y0 Z2
G3 X0 Y100 I-100 J0 E50 F1200
G2 X100 Y0 R100
G3 X100 Y0 Z4.5 I-100 E150
G17
G91
G2 X-20 R10
G20
G3 X1 Y1 I1 F30
G21
G90
G92 X0 Y0
G3 I-10
G2 X-20.02 I-10
