(the centre's J lacks its sign: the end lies off the circle)
G21 G17 G90 G94
M3 S12000
G4 P3
G0 Z5
G0 X10 Y0
G1 Z-1 F300
G3 X2 Y6 I-8 J6 F1200
G0 Z5
M5
M30
