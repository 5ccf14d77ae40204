(I0 J10 for I-10 J0: still a circle, but three quarters of the one on the other side)
G21 G17 G90 G94
M3 S12000
G4 P3
G0 Z5
G0 X10 Y0
G1 Z-1 F300
G3 X0 Y10 I0 J10 F1200
G0 Z5
M5
M30
