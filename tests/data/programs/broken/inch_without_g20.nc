(an inch program whose G20 was lost: everything is 25.4 times too small)
G17 G90 G94
M3 S12000
G4 P3
G0 Z0.25
G0 X1.0 Y0.5
G1 Z-0.125 F30
X3.0 F80
Y2.5
X1.0
Y0.5
G0 Z0.25
M5
M30
